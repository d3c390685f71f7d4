"""The answer of a run: every number of ``results.json``, and how it was found."""

from __future__ import annotations

import math
import platform
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from liggghts_driver import __version__
from liggghts_driver.accuracy import accuracy_facts
from liggghts_driver.effects import active_effects
from liggghts_driver.flowing import flowing_threshold_m_s
from liggghts_driver.identity import scene_hash, templates_hash
from liggghts_driver.prediction import NoDarcyError, steady_estimate
from liggghts_driver.results.collisions import unseen_collisions
from liggghts_driver.results.comparison import compare
from liggghts_driver.results.exact import exact_checks
from liggghts_driver.results.plain import plain
from liggghts_driver.results.positions import largest_overlap_over_radius
from liggghts_driver.results.series import complete_series, read_run_series
from liggghts_driver.results.verdict import judge
from liggghts_driver.statistics import Rate, SeriesMean, flow_rate, series_mean

if TYPE_CHECKING:
    import pandas as pd

    from liggghts_driver.case import Case
    from liggghts_driver.run import FinishedRun


@dataclass(frozen=True)
class Answer:
    """The series of a run and everything that follows from it."""

    series: pd.DataFrame
    results: dict[str, Any]

    @property
    def verdict(self) -> str:
        """``valid``, ``invalid`` or ``not_steady``."""
        return str(self.results["verdict"])


def analyse(run: FinishedRun) -> Answer:
    """Everything that a complete run says.

    Raises
    ------
    ParseError
        If a file of the engine is not what it should be.
    """
    case = run.case
    series = complete_series(read_run_series(run.directory), case)
    rates = _rates(case, series)
    velocity = _velocity(series)
    overlap = largest_overlap_over_radius(run.directory, case)
    estimate = _estimate(case)
    scale = estimate["particle_flow_rate_m3_s"] if estimate["applies"] else 0.0
    verdict = judge(case, series, rates, overlap, abs(scale))
    results = {
        "verdict": verdict.verdict,
        "reasons": list(verdict.reasons),
        "notes": [
            *([run.begun_again] if run.begun_again else []),
            *_notes(case, velocity, unseen_collisions(case, series, overlap)),
        ],
        "title": case.scene.title,
        "accuracy": accuracy_facts(case.identity),
        "counts": {
            "asked": case.population.asked,
            "placed": case.population.particles,
            "at_end": int(run.thermo.rows["Atoms"].iloc[-1]) - case.population.grains,
            "grains": case.population.grains,
        },
        "effects": _effects(case),
        "specimen": _specimen(case),
        "sections": {name: _section(case, name, rate) for name, rate in rates.items()},
        "flowing_velocity_m_s": _mean(velocity, case) if velocity else {},
        "estimate": estimate,
        "comparison": compare(rates, velocity, estimate),
        "exact": exact_checks(run),
        "time_step_s": case.time.step_s,
        "time_step_bound_s": case.time.bound_s,
        "time_step_bounds": [vars(bound) for bound in case.time.bounds],
        "max_overlap_over_radius": overlap,
        "largest_speed_m_s": float(series["largest_speed_m_s"].max()),
        "cost": _cost(run),
        "provenance": _provenance(run),
    }
    return Answer(series, plain(results))


def _notes(case: Case, velocity: SeriesMean | None, unseen: str | None) -> list[str]:
    """What a reader should know although the verdict, which is about the flow, stands."""
    notes = [] if unseen is None else [unseen]
    if velocity is not None and not velocity.steady:
        reason = velocity.reason
        notes.append(f"the mean velocity of the flowing particles is not steady: {reason}")
    if case.screened:
        names = ", ".join(case.screened)
        limit = case.identity.effects.screen
        notes.append(f"left out as too weak (effects.screen = {limit:g}): {names}")
    return notes


def _rates(case: Case, series: pd.DataFrame) -> dict[str, Rate]:
    smallest = float(case.population.particle_radii_m.min(initial=math.inf))
    quantum = 4.0 / 3.0 * math.pi * smallest**3 if math.isfinite(smallest) else 0.0
    time = series["time_s"].to_numpy()
    return {
        name: flow_rate(time, series[f"volume_{name}_m3"].to_numpy(), quantum)
        for name in case.layout.sections
    }


def _velocity(series: pd.DataFrame) -> SeriesMean | None:
    if "flowing_velocity_m_s" not in series:
        return None
    values = series["flowing_velocity_m_s"].copy()
    first = values.first_valid_index()
    if first is not None:
        values.loc[first:] = values.loc[first:].fillna(0.0)  # later, nothing flows: at rest
    return series_mean(series["time_s"].to_numpy(), values.to_numpy())


def _section(case: Case, name: str, rate: Rate) -> dict[str, Any]:
    return {
        "x_m": case.layout.sections[name],
        "particle_flow_rate_m3_s": {
            "mean": rate.mean_m3_s,
            "ci95": rate.ci95_m3_s,
            "steady": rate.steady,
            "steady_from_s": rate.steady_from_s,
            "steady_to_s": rate.steady_to_s,
            "reason": rate.reason,
            "effective_samples": rate.effective_samples,
        },
    }


def _mean(velocity: SeriesMean, case: Case) -> dict[str, Any]:
    return {
        "mean": velocity.mean,
        "ci95": velocity.ci95,
        "min": velocity.minimum,
        "max": velocity.maximum,
        "steady": velocity.steady,
        "steady_from_s": velocity.from_s,
        "reason": velocity.reason,
        "flowing_above_m_s": flowing_threshold_m_s(case.scene),
    }


def _effects(case: Case) -> dict[str, Any]:
    """What the deck had in it, and what was left out as too weak."""
    active = [effect.name for effect in active_effects(case.scene)]
    return {"active": active, "screened": list(case.screened)}


def _specimen(case: Case) -> dict[str, Any]:
    if case.scene.specimen is None:
        return {}
    return {
        "solid_fraction_asked": case.scene.specimen.solid_fraction,
        "solid_fraction": case.population.solid_fraction,
        "grains": case.population.grains,
    }


def _estimate(case: Case) -> dict[str, Any]:
    try:
        return {"applies": True, **steady_estimate(case.scene).as_dict()}
    except NoDarcyError as error:
        return {"applies": False, "reason": str(error)}


def _cost(run: FinishedRun) -> dict[str, Any]:
    particles, steps = run.case.population.particles, run.case.time.steps
    return {
        "wall_s": run.wall_s,
        "cpu_s": run.cpu_s,
        "steps": steps,
        "particles": particles,
        "ranks": run.ranks,
        "particle_steps_per_s": particles * steps / run.wall_s,
        "parts": run.parts,
    }


def _provenance(run: FinishedRun) -> dict[str, Any]:
    return {
        "scene_sha256": scene_hash(run.case.identity),
        "templates_sha256": templates_hash(),
        "seed": run.case.scene.seed,
        "liggghts_driver": __version__,
        "engine": run.engine,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "platform": sys.platform,
        "command": list(run.command),
    }
