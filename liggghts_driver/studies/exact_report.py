"""What the study of exact problems says: sentences, and the files that keep it."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import pandas as pd

from liggghts_driver import __version__
from liggghts_driver.identity import templates_hash
from liggghts_driver.outputs import write_bytes, write_text
from liggghts_driver.results.plain import plain
from liggghts_driver.studies.exact_figure import draw_exact

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from liggghts_driver.studies.exact import Measured


def results_of(
    measured: Sequence[Measured], failed: Mapping[str, str], command: Sequence[str] = ()
) -> dict[str, Any]:
    """Everything that the study found, as ``exact.json`` holds it.

    Parameters
    ----------
    measured
        Every quantity against every knob.
    failed
        Name of a run that is not there to why.
    command
        What was typed.
    """
    return dict(
        plain(
            {
                "study": "exact",
                "orders": [_row(each) for each in measured],
                "bugs": bugs(measured),
                "failed": dict(failed),
                "provenance": {
                    "command": list(command),
                    "templates_sha256": templates_hash(),
                    "liggghts_driver": __version__,
                },
            }
        )
    )


def bugs(measured: Sequence[Measured]) -> list[str]:
    """A sentence for each order that is not what it should be."""
    return [_bug(each) for each in measured if not each.is_right]


def write_results(
    measured: Sequence[Measured],
    failed: Mapping[str, str],
    folder: Path,
    command: Sequence[str] = (),
) -> dict[str, Any]:
    """Write ``exact.json``, ``exact.csv`` and ``exact.png``; what the first holds."""
    results = results_of(measured, failed, command)
    write_text(folder / "exact.json", json.dumps(results, indent=2, allow_nan=False) + "\n")
    write_text(folder / "exact.csv", pd.DataFrame(_lines(results)).to_csv(index=False))
    write_bytes(folder / "exact.png", draw_exact(measured))
    return results


def _bug(each: Measured) -> str:
    expected, order = each.expected, each.order
    found = "is not known" if math.isnan(order) else f"goes with the {each.knob.word}^{order:.2f}"
    return (
        f"bug: {each.problem.title}: the error of {each.title} {found}, where "
        f"{expected.order:g} +- {expected.within:g} is expected: {expected.why}"
    )


def _row(each: Measured) -> dict[str, Any]:
    expected = each.expected
    return {
        "problem": each.problem.name,
        "problem_title": each.problem.title,
        "variant": each.knob.title,
        "quantity": expected.quantity,
        "knob": each.knob.name,
        "expected_order": expected.order,
        "within": expected.within,
        "why": expected.why,
        "measured_order": each.order,
        "right": each.is_right,
        "cost_is": each.problem.cost,
        "values": each.knob_values,
        "errors": each.errors,
        "costs": each.costs,
        "steps": [run.steps for run in each.runs],
        "refresh_every_steps": [run.refresh_every for run in each.runs],
        "core_s": [run.core_s for run in each.runs],
    }


def _lines(results: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """A line of the table for each value of each knob."""
    several = {"value": "values", "error": "errors", "cost": "costs", "steps": "steps"}
    several |= {"refresh_every_steps": "refresh_every_steps", "core_s": "core_s"}
    for row in results["orders"]:
        shared = {key: row[key] for key in ("problem", "variant", "quantity", "knob", "cost_is")}
        orders = {key: row[key] for key in ("expected_order", "within", "measured_order", "right")}
        for values in zip(*(row[name] for name in several.values()), strict=True):
            yield shared | dict(zip(several, values, strict=True)) | orders
