"""What will happen when a case runs, without running it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from liggghts_driver.accuracy import accuracy_facts
from liggghts_driver.deck.build import FRAME_COLUMNS, PIXELS
from liggghts_driver.effects.costs import CONTACTS_NS
from liggghts_driver.physics.drag import reynolds
from liggghts_driver.prepare import decisions_of, prepare
from liggghts_driver.results.plain import plain

if TYPE_CHECKING:
    from liggghts_driver.case import Case
    from liggghts_driver.effects import Decision
    from liggghts_driver.scene.model import Scene
    from liggghts_driver.timestep import TimePlan

_DOUBLE_BYTES = 8
_COLOUR_BYTES = 3
#: What the engine tells of a piece, in its log and on the screen together.
_PIECE_LOG_BYTES = 2000
#: An effect with a smaller share of the motion than this is called weak.
_WEAK = 0.05


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
    """Accuracy, effects with reasons and weights, bounds on the time step, the size of the run."""
    population, time = case.population, case.time
    decisions = decisions_of(case)
    costs = {d.effect.name: d.effect.cost(case) for d in decisions if d.active}
    facts = {
        "accuracy": accuracy_facts(case.identity),
        "effects": [_effect(decision, case, costs) for decision in decisions],
        "drag": _drag(case),
        "time_step_s": time.step_s,
        "time_step_bounds": [vars(bound) for bound in time.bounds],
        "size": _size(case),
        "predicted_wall_s": core_times_s(population.particles, time.steps, sum(costs.values())),
    }
    return {name: plain(fact) for name, fact in facts.items()}


def _effect(decision: Decision, case: Case, costs: dict[str, float]) -> dict[str, Any]:
    """One row: in or out, why, and for what is in its number and its share of the time."""
    effect = decision.effect
    facts: dict[str, Any] = {
        "name": effect.name,
        "title": effect.title,
        "active": decision.active,
        "screened": effect.name in case.screened,
        "why": decision.reason,
    }
    if not decision.active:
        return facts
    weight = effect.weigh(case)
    return facts | {
        "number": weight.number,
        "meaning": weight.meaning,
        "value": weight.value,
        "motion_share": weight.share,
        "time_share": costs[effect.name] / sum(costs.values()),
        "weak": effect.without is not None and (weight.share or 0.0) < _WEAK,
    }


def _size(case: Case) -> dict[str, Any]:
    population, time = case.population, case.time
    return {
        "particles": population.particles,
        "grains": population.grains,
        "solid_fraction": population.solid_fraction if case.scene.specimen else 0.0,
        "time_step_s": time.step_s,
        "steps": time.steps,
        "steps_between_samples": time.sample_every,
        "steps_between_refreshes": time.refresh_every,
        "frames": frame_count(time),
        "disk_mb": disk_bytes(case, population.particles) / 1e6,
        "speed_bound_m_s": case.speed_bound_m_s,
    }


def frame_count(time: TimePlan) -> int:
    """Frames that a run writes."""
    return time.steps // time.frame_every + 1


def disk_bytes(case: Case, particles: int) -> int:
    """What a run with so many particles takes on disk, about: frames, snapshots and logs."""
    time = case.time
    frames = frame_count(time) * _DOUBLE_BYTES * len(FRAME_COLUMNS) * particles
    x, _, z = np.subtract(case.layout.high, case.layout.low)
    picture = _COLOUR_BYTES * PIXELS**2 * min(x, z) / max(x, z)
    pieces = time.steps // (time.refresh_every if time.keeps_drag else time.sample_every)
    return int(frames + case.scene.output.images * picture + pieces * _PIECE_LOG_BYTES)


def core_times_s(particles: int, steps: int, cost: float) -> dict[str, float]:
    """Engine time on one core, for a suspension that stays dilute and for a packed bed.

    ``cost`` is that of all effects together, over the cost of the contacts alone.
    """
    particle_steps = max(1, particles) * steps
    return {
        state: 1e-9 * nanoseconds * cost * particle_steps
        for state, nanoseconds in CONTACTS_NS.items()
    }


def _drag(case: Case) -> dict[str, Any] | None:
    """How the drag is integrated, and for which error; None without drag."""
    time = case.time
    if not time.drag_scheme:
        return None
    kept, chosen = time.keeps_drag, case.scene.drag.refresh is None
    return {
        "scheme": time.drag_scheme,
        "refresh_every_steps": time.refresh_every if kept else 1,
        "refresh_interval_s": time.refresh_every * time.step_s if kept else time.step_s,
        "velocity_tolerance": case.scene.drag.tolerance if kept and chosen else None,
        "largest_reynolds": _largest_reynolds(case),
    }


def _largest_reynolds(case: Case) -> float:
    """Eq. 19 for the largest particle at the largest slip that the case is expected to reach."""
    fluid, population = case.scene.fluid, case.population
    assert fluid is not None
    radius = float(population.particle_radii_m.max(initial=0.0))
    return float(reynolds(fluid.density, fluid.viscosity, radius, case.speed_bound_m_s / 2.0))
