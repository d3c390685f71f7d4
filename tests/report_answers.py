"""Answers as `analyse` would give them, made up, for tests of the report without an engine."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from small_scenes import COLLISION, INFILTRATION, case_of

from liggghts_driver.prediction import predict
from liggghts_driver.results.answer import Answer

if TYPE_CHECKING:
    from collections.abc import Mapping

    from liggghts_driver.case import Case

SAMPLES = 41
ENTRANCE_M3_S, MIDDLE_M3_S, VELOCITY_M_S = 6.789012345e-7, 5.5e-7, 1.6543e-3
STEADY_FROM_S = 0.4


def infiltration(changes: Mapping[str, Any] | None = None) -> tuple[Case, Answer]:
    """A specimen through which particles flow at constant rates once they have come."""
    case = case_of(INFILTRATION, changes)
    time = np.linspace(0.0, 1.0, SAMPLES)
    flowing = np.where(time > 0.2, VELOCITY_M_S, np.nan)
    series = {
        **_common(case, time),
        "inside": np.floor(20 * time),
        "flowing": np.floor(15 * time),
        "piston_x_m": case.layout.low[0] + 0.01 * time,
        "piston_force_n": np.where(time > 0.5, -1e-3, 0.0),
        "volume_entrance_m3": ENTRANCE_M3_S * np.maximum(time - 0.2, 0.0),
        "volume_middle_m3": MIDDLE_M3_S * np.maximum(time - 0.3, 0.0),
        "flowing_velocity_m_s": flowing,
    }
    estimate = {"applies": True, **predict(case.scene).as_dict()}
    flow, pore = estimate["particle_flow_rate_m3_s"], estimate["pore_velocity_m_s"]
    results = {
        **_results(case),
        "specimen": {"solid_fraction_asked": 0.3, "solid_fraction": 0.2987, "grains": 4},
        "sections": {
            "entrance": {"x_m": 0.0, "particle_flow_rate_m3_s": _part(ENTRANCE_M3_S, 6.7e-8)},
            "middle": {"x_m": 0.01, "particle_flow_rate_m3_s": _part(MIDDLE_M3_S, 2.6e-8)},
        },
        "flowing_velocity_m_s": _part(VELOCITY_M_S, 1e-4),
        "estimate": estimate,
        "comparison": {
            "estimate_valid": True,
            "estimate_warnings": [],
            "entrance": _pair(ENTRANCE_M3_S, 6.7e-8, flow),
            "middle": _pair(MIDDLE_M3_S, 2.6e-8, flow),
            "flowing_velocity": _pair(VELOCITY_M_S, 1e-4, pore),
        },
    }
    return case, Answer(pd.DataFrame(series), results)


def collision() -> tuple[Case, Answer]:
    """Two spheres: nothing flows, but there are exact answers."""
    case = case_of(COLLISION)
    time = np.linspace(0.0, 0.1, SAMPLES)
    exact = [
        {"name": "momentum_drift_over_scale", "simulated": 0.0, "exact": 0.0, "ratio": None},
        {"name": "restitution", "simulated": 0.7079, "exact": 0.7074, "ratio": 1.000707},
    ]
    return case, Answer(pd.DataFrame(_common(case, time)), {**_results(case), "exact": exact})


def _common(case: Case, time: np.ndarray) -> dict[str, np.ndarray]:
    return {
        "step": np.rint(time / case.time.step_s).astype(np.int64),
        "time_s": time,
        "kinetic_energy_j": 1e-9 * (1 + time),
        "largest_speed_m_s": 5e-3 * (1 - time / 2),
    }


def _part(mean: float, ci95: float) -> dict[str, Any]:
    return {
        "mean": mean,
        "ci95": ci95,
        "steady": True,
        "steady_from_s": STEADY_FROM_S,
        "steady_to_s": 1.0,
        "reason": "no drift",
    }


def _pair(simulated: float, ci95: float, estimated: float) -> dict[str, float]:
    return {
        "simulated": simulated,
        "estimated": estimated,
        "ratio": simulated / estimated,
        "z_score": 1.96 * (simulated - estimated) / ci95,
    }


def _results(case: Case) -> dict[str, Any]:
    population = case.population
    return {
        "verdict": "valid",
        "reasons": [],
        "title": "A made-up run",
        "accuracy": {},
        "counts": {
            "asked": population.asked,
            "placed": population.particles,
            "at_end": population.particles,
            "grains": population.grains,
        },
        "specimen": {},
        "sections": {},
        "flowing_velocity_m_s": {},
        "estimate": {"applies": False, "reason": "there is no specimen"},
        "comparison": {},
        "exact": [],
        "time_step_s": case.time.step_s,
        "time_step_bounds": [vars(bound) for bound in case.time.bounds],
        "max_overlap_over_radius": 0.00123,
        "largest_speed_m_s": 5e-3,
        "cost": {
            "wall_s": 12.5,
            "cpu_s": 12.25,
            "steps": case.time.steps,
            "ranks": 2,
            "particle_steps_per_s": 1.25e6,
            "parts": {"place_spheres_s": 0.25, "engine_s": 12.5, "analyse_s": 0.5},
        },
        "provenance": {"scene_sha256": "abc", "seed": 1, "command": ["engine", "a b"]},
    }
