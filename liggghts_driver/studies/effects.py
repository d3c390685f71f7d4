"""What each effect of a scene costs, and what it changes: the scene with it and without it."""

from __future__ import annotations

import json
import platform
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from liggghts_driver import __version__
from liggghts_driver.effects import active_effects
from liggghts_driver.identity import scene_hash, templates_hash
from liggghts_driver.outputs import write_bytes, write_text
from liggghts_driver.prepare import prepare
from liggghts_driver.results.plain import plain
from liggghts_driver.solve import default_directory
from liggghts_driver.studies.figure import draw_effects
from liggghts_driver.studies.observables import main_observable, title_of, unit_of
from liggghts_driver.studies.paired import paired_change, paired_ratio
from liggghts_driver.studies.table import table_of
from liggghts_driver.studies.variants import BASE, WHOLE, variants_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from liggghts_driver.case import Case
    from liggghts_driver.scene.model import Scene
    from liggghts_driver.studies.measured import Run
    from liggghts_driver.studies.variants import Variant

_Table = dict[str, Any] | None


def study_directory(scene: Scene, name: str) -> Path:
    """``runs/study-effects-<name>-<hash>``: one folder for each scene."""
    return default_directory(scene, f"study-effects-{name}")


def whole_case(scene: Scene) -> Case:
    """The case of the whole scene, which estimates go by.

    Raises
    ------
    SceneError, PackingError
        If it cannot be run: then there is nothing to compare with.
    """
    return prepare(WHOLE.scene(scene, scene.seed))


def write_results(
    scene: Scene, case: Case, runs: Sequence[Run], out: Path, command: Sequence[str] = ()
) -> dict[str, Any]:
    """Compare a scene whole and with each of its effects left out, and keep what comes out.

    Parameters
    ----------
    scene
        What was studied.
    case
        The whole of it, see ``whole_case``.
    runs
        Of every variant with every seed.
    out
        Folder of the study.
    command
        The command line, for the record.

    Returns
    -------
    What ``effects.json`` holds; ``effects.csv`` and, where there is anything to compare,
    ``effects.png`` are written beside it.
    """
    results = results_of(scene, case, runs, command)
    write_text(out / "effects.json", json.dumps(results, indent=2, allow_nan=False) + "\n")
    write_text(out / "effects.csv", table_of(results).to_csv(index=False))
    if len(results["variants"]) > 1:
        write_bytes(out / "effects.png", draw_effects(results))
    return results


def results_of(
    scene: Scene, case: Case, runs: Sequence[Run], command: Sequence[str] = ()
) -> dict[str, Any]:
    """Everything that the study found, as ``effects.json`` holds it."""
    seeds = list(dict.fromkeys(run.seed for run in runs))
    results = {
        "study": "effects",
        "title": scene.title,
        "main_observable": main_observable(scene),
        "seeds": seeds,
        "notes": _notes(scene, len(seeds)),
        "variants": [_summary(variant, case, runs) for variant in variants_of(scene)],
        "runs": [_row(run) for run in runs],
        "provenance": _provenance(scene, runs, command),
    }
    return dict(plain(results))


def _notes(scene: Scene, replicates: int) -> list[str]:
    notes = []
    if replicates == 1:
        notes.append("one replicate: changes have no interval, and what is chance is not known")
    random = (scene.specimen, scene.particles.count, scene.particles.volume_fraction)
    if random == (None, None, None):
        notes.append("every sphere is placed by the scene: replicates differ in nothing but time")
    if scene.effects.screen > 0.0:
        notes.append("effects.screen is taken as 0, so that nothing is left out but what is named")
    return notes


def _summary(variant: Variant, case: Case, runs: Sequence[Run]) -> dict[str, Any]:
    """A variant beside the whole scene."""
    own = [run for run in runs if run.variant == variant.name and run.failure is None]
    base = [run for run in runs if run.variant == BASE and run.failure is None]
    names = list(dict.fromkeys(name for run in [*base, *own] for name in run.observables))
    compared = variant.effect is not None
    return {
        "name": variant.name,
        "title": variant.title,
        "left_out": [effect.name for effect in variant.left_out],
        "follows": [effect.title for effect in variant.follows],
        "estimate": _estimate(variant, case) if compared else None,
        "finished": len(own),
        "failed": sum(run.variant == variant.name for run in runs) - len(own),
        "invalid": sum(run.verdict == "invalid" for run in own),
        "time_s_per_simulated_s": _median(own, _time),
        "steps": _median(own, lambda run: float(run.steps or 0)),
        "time_ratio": _ratio(own, base, _time) if compared else None,
        "steps_ratio": _ratio(own, base, lambda run: float(run.steps or 0)) if compared else None,
        "observables": [
            {
                "name": name,
                "title": title_of(name),
                "unit": unit_of(name),
                "mean": _mean([run.observables[name] for run in own if name in run.observables]),
                "change": _change(own, base, name) if compared else None,
            }
            for name in names
        ],
    }


def _estimate(variant: Variant, case: Case) -> dict[str, Any]:
    """What was known before: the effect's number, its share of the motion, and of a step's cost."""
    assert variant.effect is not None
    weight = variant.effect.weigh(case)
    costs = {effect.name: effect.cost(case) for effect in active_effects(case.scene)}
    return {
        "number": weight.number,
        "meaning": weight.meaning,
        "value": weight.value,
        "motion_share": weight.share,
        "time_share": sum(costs[effect.name] for effect in variant.left_out) / sum(costs.values()),
    }


def _time(run: Run) -> float:
    assert run.time_s_per_simulated_s is not None
    return run.time_s_per_simulated_s


def _ratio(own: list[Run], base: list[Run], value: Callable[[Run], float]) -> _Table:
    ratio = paired_ratio({r.seed: value(r) for r in own}, {r.seed: value(r) for r in base})
    return asdict(ratio) if ratio else None


def _change(own: list[Run], base: list[Run], name: str) -> _Table:
    values, others = (
        {run.seed: run.observables[name] for run in some if name in run.observables}
        for some in (own, base)
    )
    change = paired_change(values, others)
    return asdict(change) if change else None


def _median(runs: list[Run], value: Callable[[Run], float]) -> float | None:
    return float(np.median([value(run) for run in runs])) if runs else None


def _mean(values: list[float]) -> float | None:
    return float(np.mean(values)) if values else None


def _row(run: Run) -> dict[str, Any]:
    row = asdict(run)
    del row["provenance"]
    return row | {"folder": str(run.folder)}


def _provenance(scene: Scene, runs: Sequence[Run], command: Sequence[str]) -> dict[str, Any]:
    engines = {str(run.provenance.get("engine")) for run in runs if run.failure is None}
    return {
        "command": list(command),
        "scene_sha256": scene_hash(scene),
        "templates_sha256": templates_hash(),
        "liggghts_driver": __version__,
        "engines": sorted(engines),
        "python": platform.python_version(),
        "host": platform.node(),
    }
