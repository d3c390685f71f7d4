"""What will happen when a case runs, without running it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from liggghts_driver.deck.build import FRAME_COLUMNS
from liggghts_driver.effects import decide_effects
from liggghts_driver.prepare import prepare

if TYPE_CHECKING:
    from liggghts_driver.case import Case
    from liggghts_driver.scene.model import Scene

_DOUBLE_BYTES = 8


def explain(scene: Scene) -> dict[str, Any]:
    """Say what a scene calls for, how long its steps are and how large it is; run nothing.

    Raises
    ------
    PackingError
        If the spheres cannot be placed.
    SceneError
        If the step asked for is above a bound.
    """
    return explain_case(prepare(scene))


def explain_case(case: Case) -> dict[str, Any]:
    """Effects with their reasons, bounds on the time step, and the size of the run."""
    population, time = case.population, case.time
    frames = time.steps // time.frame_every + 1
    frame_bytes = _DOUBLE_BYTES * len(FRAME_COLUMNS) * population.particles
    return {
        "effects": [
            {
                "name": decision.effect.name,
                "title": decision.effect.title,
                "active": decision.active,
                "why": decision.reason,
            }
            for decision in decide_effects(case.scene)
        ],
        "drag": _drag(case),
        "time_step_s": time.step_s,
        "time_step_bounds": [vars(bound) for bound in time.bounds],
        "size": {
            "particles": population.particles,
            "grains": population.grains,
            "solid_fraction": population.solid_fraction if case.scene.specimen else 0.0,
            "time_step_s": time.step_s,
            "steps": time.steps,
            "steps_between_samples": time.sample_every,
            "steps_between_refreshes": time.refresh_every,
            "frames": frames,
            "disk_mb": frames * frame_bytes / 1e6,
            "speed_bound_m_s": case.speed_bound_m_s,
        },
    }


def _drag(case: Case) -> dict[str, Any] | None:
    """How the drag is integrated, and for which error; None without drag."""
    time = case.time
    if not time.drag_scheme:
        return None
    kept = time.keeps_drag
    return {
        "scheme": time.drag_scheme,
        "refresh_every_steps": time.refresh_every if kept else 1,
        "refresh_interval_s": time.refresh_every * time.step_s if kept else time.step_s,
        "velocity_tolerance": case.scene.drag.tolerance if kept else None,
    }
