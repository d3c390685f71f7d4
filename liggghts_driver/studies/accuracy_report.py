"""What a study of accuracy says: tables, sentences, and the files that keep them."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import pandas as pd

from liggghts_driver import __version__
from liggghts_driver.accuracy import FINEST, Study, choose, problem_sha256
from liggghts_driver.identity import scene_hash, templates_hash
from liggghts_driver.outputs import write_bytes, write_text
from liggghts_driver.results.plain import plain
from liggghts_driver.scene.layout import layout
from liggghts_driver.studies.accuracy import judge, noise
from liggghts_driver.studies.accuracy_figure import draw_accuracy
from liggghts_driver.studies.accuracy_orders import orders

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from liggghts_driver.scene.model import Scene
    from liggghts_driver.studies.accuracy import Judged, Measured

_COLUMNS = (
    "knob", "value", "title", "cost_over_reference", "core_s_per_simulated_s",
    "largest_overlap_over_radius",
)  # fmt: skip
_BOUNDS = (0.01, 0.02, 0.05, 0.10)


def main_names(scene: Scene) -> list[str]:
    """The quantities that settings are chosen by: what flows into the specimen, rate and volume.

    What passes further inside is fewer particles, later: its errors stand beside.
    """
    first = next(iter(layout(scene).sections))
    return [f"rate_{first}", f"volume_{first}_1"]


def shown_names(scene: Scene) -> list[str]:
    """The quantities that are printed: rates, volumes at the end, and the particles' velocity."""
    sections = layout(scene).sections
    volumes = [f"volume_{name}_1" for name in sections]
    return [*(f"rate_{name}" for name in sections), *volumes, "flowing_velocity"]


def results_of(
    scene: Scene,
    measured: Sequence[Measured],
    failures: Mapping[str, str] | None = None,
    command: Sequence[str] = (),
) -> dict[str, Any]:
    """Everything that the study found, as ``accuracy.json`` holds it.

    Parameters
    ----------
    scene
        What was studied.
    measured
        Its finished runs.
    failures
        Name of a run that has no answer to the reason: a setting may be beyond what holds.
    command
        The command line, for the record.
    """
    judged, shown = judge(measured), shown_names(scene)
    found = {
        "study": "accuracy",
        "title": scene.title,
        "problem_sha256": problem_sha256(scene),
        "duration_s": scene.time.duration,
        "seeds": sorted({m.seed for m in measured}),
        "chosen_by": main_names(scene),
        "shown": shown,
        "finest": _finest(scene),
        "noise": {name: noise(measured, name) for name in shown},
        "settings": [_row(each) for each in judged],
        "orders": orders(judged, main_names(scene)[0]),
        "failures": dict(failures or {}),
        "provenance": {
            "command": list(command),
            "scene_sha256": scene_hash(scene),
            "templates_sha256": templates_hash(),
            "liggghts_driver": __version__,
        },
    }
    results = dict(plain(found))
    return {**results, "sentences": [sentence(results, bound) for bound in _BOUNDS]}


def sentence(results: Mapping[str, Any], bound: float) -> str:
    """The cheapest setting that is known to hold a bound, its interval included."""
    best = choose(Study.model_validate(results), bound)
    if best is None or best.finest:
        return f"within {bound:.0%}: no setting is known to be; run more packings"
    return (
        f"within {bound:.0%}: {best.title}, at {best.cost_over_reference:.3g} of the reference's "
        f"time ({best.error:.1%} on average, at most {best.reach:.1%} with 95 % certainty)"
    )


def write_results(
    scene: Scene,
    measured: Sequence[Measured],
    folder: Path,
    failures: Mapping[str, str] | None = None,
    command: Sequence[str] = (),
) -> dict[str, Any]:
    """Write ``accuracy.json``, ``accuracy.csv`` and ``accuracy.png``; what the first holds.

    Without a finished reference there is nothing to draw.
    """
    results = results_of(scene, measured, failures, command)
    write_text(folder / "accuracy.json", json.dumps(results, indent=2, allow_nan=False) + "\n")
    write_text(folder / "accuracy.csv", _table(results).to_csv(index=False))
    panels = {
        f"rate_{name}": f"flow rate, {name} [%]"
        for name in layout(scene).sections
        if any(f"rate_{name}" in row["errors"] for row in results["settings"])
    }
    noises = {name: noise(measured, name) for name in panels}
    if panels:
        write_bytes(folder / "accuracy.png", draw_accuracy(judge(measured), panels, noises))
    return results


def _finest(scene: Scene) -> dict[str, Any]:
    """The reference's settings, with what the study leaves as the scene has it."""
    if scene.dragging_fluid is None:
        return dict(FINEST)
    return {**FINEST, "drag.scheme": scene.drag.scheme, "drag.carrier": scene.drag.carrier}


def _row(judged: Judged) -> dict[str, Any]:
    setting = judged.setting
    return {
        "knob": setting.knob,
        "value": setting.value,
        "title": setting.title,
        "changes": dict(setting.changes),
        "cost_over_reference": judged.cost,
        "core_s_per_simulated_s": judged.core_s_per_s,
        "expected_order": setting.order,
        "largest_overlap_over_radius": judged.overlap_over_radius,
        "errors": {name: asdict(change) for name, change in judged.errors.items()},
        "below_noise": [name for name in judged.errors if judged.is_below_noise(name)],
    }


def _table(results: dict[str, Any]) -> pd.DataFrame:
    rows = []
    for setting in results["settings"]:
        row = {key: setting[key] for key in _COLUMNS}
        for name, change in setting["errors"].items():
            row[f"relative_error_of_{name}"] = change["mean"]
            row[f"relative_error_ci95_of_{name}"] = change["ci95"]
            row[f"is_below_noise_of_{name}"] = name in setting["below_noise"]
        rows.append(row)
    return pd.DataFrame(rows)
