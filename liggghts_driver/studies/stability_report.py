"""What the study of stability says: a row for each hard case, and the files that keep it."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import pandas as pd

from liggghts_driver import __version__
from liggghts_driver.identity import templates_hash
from liggghts_driver.outputs import write_bytes, write_text
from liggghts_driver.results.plain import plain
from liggghts_driver.studies.invariants import hardest
from liggghts_driver.studies.stability_figure import draw_stability

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from liggghts_driver.studies.broken import Broken
    from liggghts_driver.studies.invariants import Invariant
    from liggghts_driver.studies.stability import Studied, Trial
    from liggghts_driver.studies.stability_map import Point

#: What a row of the table has; the rest of ``stability.json`` is lists.
_COLUMNS = (
    "case", "hard", "expected", "as_expected", "step_s", "hardest_invariant", "worst", "limit",
    "share_of_limit", "margin", "breaks_at", "broken_by", "breaks_by", "refused_beyond", "why",
)  # fmt: skip
#: The same of what is broken on purpose.
_BROKEN_COLUMNS = ("case", "sabotage", "fate", "by", "apart_over_radius", "sentence")


def results_of(
    studied: Sequence[Studied],
    points: Sequence[Point] = (),
    broken: Sequence[Broken] = (),
    command: Sequence[str] = (),
) -> dict[str, Any]:
    """Everything that the study found, as ``stability.json`` holds it.

    Parameters
    ----------
    studied
        Every hard case.
    points
        Of the map; none where it was not made.
    broken
        The cases broken on purpose; none where they were not.
    command
        What was typed.
    """
    rows = [_row(each) for each in studied]
    return dict(
        plain(
            {
                "study": "stability",
                "cases": rows,
                "broken": [row["case"] for row in rows if not row["as_expected"]],
                "map": [vars(point) for point in points],
                "on_purpose": [_broken(each) for each in broken],
                "hidden": [f"{each.case}, {each.sabotage}" for each in broken if each.hides],
                "provenance": {
                    "command": list(command),
                    "templates_sha256": templates_hash(),
                    "liggghts_driver": __version__,
                },
            }
        )
    )


def write_results(
    studied: Sequence[Studied],
    points: Sequence[Point],
    folder: Path,
    broken: Sequence[Broken] = (),
    command: Sequence[str] = (),
) -> dict[str, Any]:
    """Write ``stability.json`` and ``stability.csv``.

    With a map ``stability.png`` too, and ``broken.csv`` where cases were broken on purpose.
    """
    results = results_of(studied, points, broken, command)
    write_text(folder / "stability.json", json.dumps(results, indent=2, allow_nan=False) + "\n")
    table = pd.DataFrame(results["cases"], columns=list(_COLUMNS))
    write_text(folder / "stability.csv", table.to_csv(index=False))
    if broken:
        table = pd.DataFrame(results["on_purpose"], columns=list(_BROKEN_COLUMNS))
        write_text(folder / "broken.csv", table.to_csv(index=False))
    if points:
        write_bytes(folder / "stability.png", draw_stability(points))
    return results


def _row(each: Studied) -> dict[str, Any]:
    own, broken = each.own, each.first_broken
    assert own is not None
    worst = hardest(own.invariants) if own.invariants else None
    return {
        "case": each.case.name,
        "hard": each.case.hard,
        "expected": each.case.expected,
        "as_expected": each.as_expected,
        "step_s": each.step_s,
        "hardest_invariant": worst.name if worst else "",
        "worst": worst.worst if worst else None,
        "limit": worst.limit if worst else None,
        "share_of_limit": worst.share if worst else None,
        "margin": each.margin if each.trials else None,
        "breaks_at": broken.factor if broken else None,
        "broken_by": broken.broken_by if broken else "",
        "breaks_by": broken.why if broken else "",
        "refused_beyond": bool(broken and broken.refused),
        "why": own.why,
        "invariants": [_invariant(invariant) for invariant in own.invariants],
        "trials": [_trial(trial) for trial in sorted(each.trials, key=lambda t: t.factor)],
    }


def _broken(each: Broken) -> dict[str, Any]:
    return {
        "case": each.case,
        "sabotage": each.sabotage,
        "fate": each.fate,
        "by": each.by,
        "apart_over_radius": each.apart if math.isfinite(each.apart) else None,
        "sentence": each.sentence,
    }


def _invariant(invariant: Invariant) -> dict[str, Any]:
    return {
        "name": invariant.name,
        "worst": invariant.worst,
        "limit": invariant.limit,
        "holds": not invariant.broken,
        "not_applicable_because": invariant.why_not,
    }


def _trial(trial: Trial) -> dict[str, Any]:
    worst = hardest(trial.invariants) if trial.invariants else None
    return {
        "factor": trial.factor,
        "holds": trial.holds,
        "refused_before_launch": trial.refused,
        "why": trial.why,
        "hardest_invariant": worst.name if worst else "",
        "share_of_limit": worst.share if worst and math.isfinite(worst.share) else None,
    }
