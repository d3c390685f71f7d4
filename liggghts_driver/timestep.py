"""The time step: the bound that counts, and the plan of a run in steps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver.bounds import Bound, drag_bound, free_bounds
from liggghts_driver.drag_plan import LONGEST_KEPT, DragPlan, plan_drag
from liggghts_driver.errors import SceneError

if TYPE_CHECKING:
    from liggghts_driver.population import Population
    from liggghts_driver.scene.layout import Layout
    from liggghts_driver.scene.model import Scene

#: The engine counts the steps of a run in 32 bits.
_MOST_STEPS = 2**31 - 1


@dataclass(frozen=True)
class TimePlan:
    """The run in steps.

    The series is sampled every ``sample_every`` steps; drag coefficients that are kept are renewed
    every ``refresh_every``, which divides it, as it divides all other intervals and ``steps``.
    ``drag_scheme`` is that of the drag, empty without one; ``drag_resolved`` says that particles
    relax slowly beside the refreshes. ``bounds`` are sorted, the one that counts first.
    """

    step_s: float
    steps: int
    sample_every: int
    refresh_every: int
    frame_every: int
    image_every: int
    drag_scheme: str
    drag_resolved: bool
    bounds: tuple[Bound, ...]

    @property
    def keeps_drag(self) -> bool:
        """Whether drag is computed now and then and kept in between."""
        return self.drag_scheme in ("held", "implicit")

    @property
    def bound_s(self) -> float:
        """The largest step that respects every bound."""
        return self.bounds[0].step_s


def plan_time(scene: Scene, layout: Layout, population: Population, speed_m_s: float) -> TimePlan:
    """Choose the step and lay the run out in steps.

    Without ``time.step`` the largest step within all bounds is taken, shortened so that the
    samples fall on whole steps. ``speed_m_s`` is the bound on relative speeds.

    Raises
    ------
    SceneError
        If ``time.step`` is above a bound, naming the bound, its value and the way out.
    """
    bounds = free_bounds(scene, layout, population, speed_m_s)
    free = min(bound.step_s for bound in bounds)
    # The bound on the speed is for two particles that meet head-on; the fluid is not one of them.
    drag = plan_drag(scene, population, speed_m_s / 2.0, scene.time.step or free)
    if drag is not None and drag.scheme != "implicit" and population.particles:
        bounds.append(drag_bound(drag))
    bounds.sort(key=lambda bound: bound.step_s)
    _check_step(scene, bounds[0])
    interval = scene.time.duration / scene.output.samples
    longest = interval if drag is None else drag.interval_s
    wanted = scene.time.step
    if wanted is None:
        refreshes, refresh_every = _split(interval, longest, bounds[0].step_s)
        step = interval / (refreshes * refresh_every)
    else:
        step = wanted
        refreshes, refresh_every = _whole(interval, longest, step)
    sample_every = refreshes * refresh_every
    samples = max(1, round(scene.time.duration / (step * sample_every)))
    steps = samples * sample_every
    if steps > _MOST_STEPS:
        raise SceneError(
            f"time.duration = {scene.time.duration:g} s: {steps:.3g} steps of {step:.3g} s; the "
            f"engine counts to {_MOST_STEPS:.3g}; {_way_out(scene, bounds[0])}"
        )
    return TimePlan(
        step_s=step,
        steps=steps,
        sample_every=sample_every,
        refresh_every=refresh_every,
        frame_every=_every(steps, scene.output.frames, sample_every),
        image_every=_every(steps, max(scene.output.images - 1, 1), sample_every),
        drag_scheme="" if drag is None else drag.scheme,
        drag_resolved=drag is None or _resolved(drag, step * refresh_every),
        bounds=tuple(bounds),
    )


def _resolved(drag: DragPlan, kept_s: float) -> bool:
    # The interval is whole steps: what was within the bound may pass it by rounding.
    return drag.scheme != "implicit" or kept_s <= LONGEST_KEPT * drag.relaxation_s


def _way_out(scene: Scene, limit: Bound) -> str:
    """What to change where there are too many steps."""
    if scene.time.step is not None and scene.time.step < 0.5 * limit.step_s:
        return f"lengthen time.step, which may be {limit.step_s:.3g} s"
    return (
        f"shorten the duration, or change what bounds the step: {limit.name} ({limit.reason}), as "
        "contact.stiffness_scale does for a contact"
    )


def _check_step(scene: Scene, limit: Bound) -> None:
    wanted = scene.time.step
    if wanted is not None and wanted > limit.step_s * (1 + 1e-9):
        raise SceneError(
            f"time.step = {wanted:g} s: must be at most {limit.step_s:.4g} s, set by "
            f"{limit.name} ({limit.reason}); shorten or remove time.step, or raise "
            "time.step_fraction if a contact sets it"
        )


def _split(interval_s: float, longest_s: float, step_bound_s: float) -> tuple[int, int]:
    """Refreshes per sample and steps per refresh, the step within its bound."""
    refreshes = math.ceil(interval_s / longest_s * (1 - 1e-12))
    return refreshes, math.ceil(interval_s / refreshes / step_bound_s * (1 - 1e-12))


def _whole(interval_s: float, longest_s: float, step_s: float) -> tuple[int, int]:
    """The same for a given step: the interval between samples gives way by a few steps."""
    steps = max(1, round(interval_s / step_s))
    refreshes = math.ceil(steps / max(1, math.floor(longest_s / step_s * (1 + 1e-12))))
    return refreshes, max(1, round(steps / refreshes))


def _every(steps: int, wanted: int, sample_every: int) -> int:
    """Interval in steps for about that many outputs, on instants that the series also has."""
    return sample_every * max(1, round(steps / (wanted * sample_every)))


def frame_steps(plan: TimePlan) -> list[int]:
    """The steps of which there are frames: every ``frame_every``, and the last."""
    return [*range(0, plan.steps, plan.frame_every), plan.steps]
