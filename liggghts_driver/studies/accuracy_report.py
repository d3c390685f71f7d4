"""What a study of accuracy says: tables, sentences, and the files that keep them."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import pandas as pd

from liggghts_driver import __version__
from liggghts_driver.results.plain import plain
from liggghts_driver.rundir import scene_hash, templates_hash, write_bytes, write_text
from liggghts_driver.scene.layout import layout
from liggghts_driver.studies.accuracy import cheapest_within, judge, noise
from liggghts_driver.studies.accuracy_figure import draw_accuracy
from liggghts_driver.studies.knobs import REFERENCE

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from liggghts_driver.scene.model import Scene
    from liggghts_driver.studies.accuracy import Judged, Measured
    from liggghts_driver.studies.paired import Change

_BOUNDS = (0.01, 0.02, 0.05, 0.10)
#: Fewer pairs than this have no interval that says anything.
_FEW = 2


def main_names(scene: Scene) -> list[str]:
    """The quantities that settings are chosen by: what flows through each section."""
    sections = layout(scene).sections
    return [*(f"rate_{name}" for name in sections), *(f"volume_{name}_1" for name in sections)]


def results_of(
    scene: Scene, measured: Sequence[Measured], command: Sequence[str] = ()
) -> dict[str, Any]:
    """Everything that the study found, as ``accuracy.json`` holds it."""
    judged, names = judge(measured), main_names(scene)
    return dict(
        plain(
            {
                "study": "accuracy",
                "title": scene.title,
                "seeds": sorted({m.seed for m in measured}),
                "chosen_by": names,
                "noise": {name: noise(measured, name) for name in names},
                "settings": [_row(each, measured, names) for each in judged],
                "sentences": [sentence(judged, names, bound) for bound in _BOUNDS],
                "provenance": {
                    "command": list(command),
                    "scene_sha256": scene_hash(scene),
                    "templates_sha256": templates_hash(),
                    "liggghts_driver": __version__,
                },
            }
        )
    )


def sentence(judged: Sequence[Judged], names: Sequence[str], bound: float) -> str:
    """The cheapest setting that held a bound."""
    best = cheapest_within([j for j in judged if j.setting is not REFERENCE], names, bound)
    if best is None:
        return f"within {bound:.0%}: no setting of this study; take the reference"
    known = [best.errors[name] for name in names if name in best.errors]
    reach = max(abs(change.mean) + (change.ci95 or 0.0) for change in known)
    unsure = "" if reach <= bound else f", with an interval that reaches to {reach:.1%}"
    return (
        f"within {bound:.0%}: {best.setting.title}, at {best.cost:.3g} of the reference's time "
        f"(largest mean error {best.worst(names):.1%}{unsure})"
    )


def write_results(
    scene: Scene, measured: Sequence[Measured], folder: Path, command: Sequence[str] = ()
) -> dict[str, Any]:
    """Write ``accuracy.json``, ``accuracy.csv`` and ``accuracy.png``; what the first holds."""
    results = results_of(scene, measured, command)
    write_text(folder / "accuracy.json", json.dumps(results, indent=2, allow_nan=False) + "\n")
    write_text(folder / "accuracy.csv", _table(results).to_csv(index=False))
    name = main_names(scene)[0]
    drawn = draw_accuracy(judge(measured), name, "flow rate, entrance", noise(measured, name))
    write_bytes(folder / "accuracy.png", drawn)
    return results


def _row(judged: Judged, measured: Sequence[Measured], names: Sequence[str]) -> dict[str, Any]:
    setting = judged.setting
    replicates = max((change.replicates for change in judged.errors.values()), default=0)
    below = [name for name in names if replicates >= _FEW and _is_below(judged.errors.get(name))]
    return {
        "knob": setting.knob,
        "value": setting.value,
        "title": setting.title,
        "changes": dict(setting.changes),
        "cost_over_reference": judged.cost,
        "expected_order": setting.order,
        "largest_overlap_over_radius": judged.overlap_over_radius,
        "replicates": replicates,
        "errors": {name: asdict(change) for name, change in judged.errors.items()},
        "below_noise": below,
        "runs": [m.seed for m in measured if m.setting.title == setting.title],
    }


def _is_below(change: Change | None) -> bool:
    """Whether an error is no larger than its own interval."""
    return change is not None and abs(change.mean) <= (change.ci95 or 0.0)


def _table(results: dict[str, Any]) -> pd.DataFrame:
    rows = []
    for setting in results["settings"]:
        row = {key: setting[key] for key in ("knob", "value", "title", "cost_over_reference")}
        row["largest_overlap_over_radius"] = setting["largest_overlap_over_radius"]
        for name, change in setting["errors"].items():
            row[f"relative_error_of_{name}"] = change["mean"]
            row[f"relative_error_ci95_of_{name}"] = change["ci95"]
        rows.append(row)
    return pd.DataFrame(rows)
