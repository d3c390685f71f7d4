"""The time step: every bound on it, the one that counts, and the plan of a run in steps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.drag_plan import LONGEST_KEPT, DragPlan, plan_drag
from liggghts_driver.errors import SceneError
from liggghts_driver.physics.contact import Body, contact_duration_s
from liggghts_driver.physics.drag import free_flight_speed_m_s
from liggghts_driver.physics.spheres import sphere_volume_m3
from liggghts_driver.prediction import pore_velocity_m_s
from liggghts_driver.scene.elastic import elastic

if TYPE_CHECKING:
    from liggghts_driver.population import Population
    from liggghts_driver.scene.layout import Layout
    from liggghts_driver.scene.model import Scene

#: Explicit drag is stable below K dt / m = 2 and within 5 % of exact relaxation at 0.1.
LARGEST_DRAG_NUMBER = 0.1
#: The engine counts the steps of a run in 32 bits.
_MOST_STEPS = 2**31 - 1
#: The neighbour lists reach at most this far beyond contact [mean particle radii].
LONGEST_SKIN = 1.0
#: The servo's vel_max is below skin / (2 dt), and twice what the piston may reach.
_PISTON_SHARE = 0.98 / 4.0
#: A scene in which nothing can move is bounded as if things moved at this speed.
_SLOWEST_M_S = 1e-6


@dataclass(frozen=True)
class Bound:
    """One upper bound on the time step, and why."""

    name: str
    step_s: float
    reason: str


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


def speed_bound_m_s(scene: Scene, layout: Layout, population: Population) -> float:
    """A relative speed that contacts of this scene are not expected to exceed [m/s].

    The sum of what each cause could give alone: the piston over its longest free way, the fluid,
    the free flight under the pressure gradient, gravity over the height, and the initial speeds;
    twice that, since two particles may meet head-on.
    """
    causes = (
        _piston_speed(scene, layout),
        _fluid_speed(scene),
        _driven_speed(scene, layout, population),
        _initial_speed(population),
    )
    return max(2.0 * sum(causes), _SLOWEST_M_S)


def _piston_speed(scene: Scene, layout: Layout) -> float:
    if scene.piston is None:
        return 0.0
    way = layout.fill_high[0] - layout.fill_low[0]
    free = math.sqrt(2.0 * scene.piston.acceleration * way)
    return min(free, scene.piston.acceleration * scene.time.duration)


def _fluid_speed(scene: Scene) -> float:
    fluid = scene.dragging_fluid
    if fluid is None:
        return 0.0
    inside = abs(pore_velocity_m_s(scene)) if fluid.velocity_inside == "pore" else 0.0
    if fluid.velocity_outside == "constant":
        return max(inside, abs(fluid.velocity))
    if fluid.velocity_outside == "accelerating":
        return max(inside, abs(fluid_acceleration_m_s2(scene)) * scene.time.duration)
    return inside  # at rest outside, or with the piston, whose speed is counted already


def fluid_speed_m_s(scene: Scene, layout: Layout) -> float:
    """The largest speed of the fluid anywhere, its motion with the piston included."""
    if scene.fluid is not None and scene.fluid.velocity_outside == "piston":
        return max(_fluid_speed(scene), _piston_speed(scene, layout))
    return _fluid_speed(scene)


def fluid_acceleration_m_s2(scene: Scene) -> float:
    """Acceleration of the fluid outside: its own, or else the piston's."""
    assert scene.fluid is not None
    if scene.fluid.acceleration is not None:
        return scene.fluid.acceleration
    return scene.piston.acceleration if scene.piston else 0.0


def _driven_speed(scene: Scene, layout: Layout, population: Population) -> float:
    """Speed under pressure and gravity: free flight in a fluid, free fall without."""
    if not population.particles:
        return 0.0
    radius = float(population.particle_radii_m.max())
    density = scene.particles.density
    gradient = abs(scene.pressure.gradient) if scene.pressure else 0.0
    gravity = math.hypot(*scene.gravity.acceleration) if scene.gravity else 0.0
    # A fluid denser than the particles drives them upwards, with more than their weight.
    buoyant = abs(1.0 - scene.buoyed_share)
    acceleration = 1.5 * gradient / density + buoyant * gravity
    diagonal = math.dist(layout.low, layout.high)
    falling = math.sqrt(2.0 * acceleration * diagonal)
    fluid = scene.dragging_fluid
    if fluid is None:
        return falling
    force = density * sphere_volume_m3(radius) * acceleration
    return min(falling, free_flight_speed_m_s(fluid.density, fluid.viscosity, radius, force))


def _initial_speed(population: Population) -> float:
    """Half the sum of the two largest initial speeds: twice this is the fastest they can meet."""
    speeds = np.sort(np.linalg.norm(population.velocities_m_s, axis=1))
    return float(speeds[-2:].sum()) / 2.0


def _free_bounds(
    scene: Scene, layout: Layout, population: Population, speed_m_s: float
) -> list[Bound]:
    """Every bound on the time step but that of the drag."""
    longest = scene.time.duration / scene.output.samples
    return [
        *contact_bounds(scene, layout, population, speed_m_s),
        *_piston_bounds(scene, population, speed_m_s),
        Bound("duration", longest, "one step per sample"),
    ]


def _piston_bounds(scene: Scene, population: Population, speed_m_s: float) -> list[Bound]:
    """The engine's servo asks for steps short beside the skin, the neighbour lists' reach.

    Particles need no such bound: the engine looks at every step whether one has moved by half of
    the skin, and builds the lists again before it computes forces.
    """
    if scene.piston is None or not len(population.radii_m):
        return []
    skin = LONGEST_SKIN * mean_radius_m(population)
    reason = (
        f"the engine's limit on the piston, skin / (2 step), twice above {speed_m_s:.3g} m/s; "
        f"the skin is at most {skin:.3g} m"
    )
    return [Bound("piston", _PISTON_SHARE * skin / speed_m_s, reason)]


def mean_radius_m(population: Population) -> float:
    """The mean radius of the particles, or of the grains where there are none."""
    radii = population.particle_radii_m
    return float(radii.mean() if len(radii) else population.radii_m.mean())


def contact_bounds(
    scene: Scene, layout: Layout, population: Population, speed_m_s: float
) -> list[Bound]:
    """Eq. 21 for the quickest contact of each kind: that of the smallest particle."""
    if not population.particles:
        return []
    bounds = []
    for name, partner in _partners(scene, layout, population).items():
        particle = _particle_body(scene, population)
        duration = contact_duration_s(particle, partner, speed_m_s)
        fraction = scene.time.step_fraction
        reason = (
            f"{fraction:g} of the shortest {name} contact, {duration:.3g} s at {speed_m_s:.3g} m/s "
            "(Eq. 21)"
        )
        bounds.append(Bound(f"contact {name}", fraction * duration, reason))
    return bounds


def _particle_body(scene: Scene, population: Population) -> Body:
    radius = float(population.particle_radii_m.min())
    mass = scene.particles.density * sphere_volume_m3(radius)
    return Body(radius, mass, *elastic(scene, "particles"))


def _partners(scene: Scene, layout: Layout, population: Population) -> dict[str, Body]:
    partners = {}
    if population.particles > 1:
        partners["particle-particle"] = _particle_body(scene, population)
    if population.grains and scene.grains is not None:
        # Eq. 21 falls with r*: the largest grain makes the shortest contact.
        radius = float(population.radii_m[population.particles :].max())
        partners["particle-grain"] = Body(radius, math.inf, *elastic(scene, "grains"))
    if layout.walls or scene.piston:
        partners["particle-wall"] = Body(math.inf, math.inf, *elastic(scene, "walls"))
    return partners


def _drag_bound(drag: DragPlan) -> Bound:
    relaxation = drag.relaxation_s
    reason = f"K dt/m below {LARGEST_DRAG_NUMBER}: a particle relaxes in {relaxation:.3g} s"
    return Bound("drag", LARGEST_DRAG_NUMBER * relaxation, reason)


def plan_time(scene: Scene, layout: Layout, population: Population) -> TimePlan:
    """Choose the step and lay the run out in steps.

    Without ``time.step`` the largest step within all bounds is taken, shortened so that the
    samples fall on whole steps.

    Raises
    ------
    SceneError
        If ``time.step`` is above a bound, naming the bound, its value and the way out.
    """
    speed = speed_bound_m_s(scene, layout, population)
    bounds = _free_bounds(scene, layout, population, speed)
    free = min(bound.step_s for bound in bounds)
    # The bound on the speed is for two particles that meet head-on; the fluid is not one of them.
    drag = plan_drag(scene, population, speed / 2.0, scene.time.step or free)
    if drag is not None and drag.scheme != "implicit" and population.particles:
        bounds.append(_drag_bound(drag))
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
            f"time.duration = {scene.time.duration:g} s: {steps} steps of {step:.3g} s; the engine "
            f"counts to {_MOST_STEPS}; shorten the duration or soften the contacts"
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
