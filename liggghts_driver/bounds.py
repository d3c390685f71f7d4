"""Every upper bound on the time step, each with its reason."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver.loads import pressing_force_n
from liggghts_driver.physics.contact import contact_duration_s, pressed_half_period_s
from liggghts_driver.scene.elastic import fixed_body, particle_body
from liggghts_driver.scene.swing import swing_period_s

if TYPE_CHECKING:
    from collections.abc import Iterator

    from liggghts_driver.drag_plan import DragPlan
    from liggghts_driver.physics.contact import Body
    from liggghts_driver.population import Population
    from liggghts_driver.scene.layout import Layout
    from liggghts_driver.scene.model import Scene

#: Explicit drag is stable below K dt / m = 2 and within 5 % of exact relaxation at 0.1.
LARGEST_DRAG_NUMBER = 0.1
#: The neighbour lists reach at most this far beyond contact [mean particle radii].
LONGEST_SKIN = 1.0
#: Velocity Verlet is off by (w dt)^2 / 12 under a force cos(w t), 3e-4 of it at a hundredth of the
#: period. Nothing but contacts and drag resolves a period: without them it would be one step.
_STEPS_OF_A_PERIOD = 100
#: The servo's vel_max is below skin / (2 dt), and twice what the piston may reach.
_PISTON_SHARE = 0.98 / 4.0


@dataclass(frozen=True)
class Bound:
    """One upper bound on the time step, and why."""

    name: str
    step_s: float
    reason: str


def free_bounds(
    scene: Scene, layout: Layout, population: Population, speed_m_s: float
) -> list[Bound]:
    """Every bound on the time step but that of the drag."""
    longest = scene.time.duration / scene.output.samples
    return [
        *contact_bounds(scene, layout, population, speed_m_s),
        *pressed_bounds(scene, layout, population),
        *_piston_bounds(scene, population, speed_m_s),
        *period_bounds(scene),
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


def period_bounds(scene: Scene) -> list[Bound]:
    """A hundredth of the period of a pressure gradient that goes to and fro."""
    period = swing_period_s(scene)
    if period is None:
        return []
    reason = f"1/{_STEPS_OF_A_PERIOD} of pressure.period, {period:.3g} s"
    return [Bound("period", period / _STEPS_OF_A_PERIOD, reason)]


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
    fraction, bounds = scene.time.step_fraction, []
    for name, particle, partner in _encounters(scene, layout, population):
        duration = contact_duration_s(particle, partner, speed_m_s)
        reason = (
            f"{fraction:g} of the shortest {name} contact, {duration:.3g} s at {speed_m_s:.3g} m/s "
            "(Eq. 21)"
        )
        bounds.append(Bound(f"contact {name}", fraction * duration, reason))
    return bounds


def pressed_bounds(scene: Scene, layout: Layout, population: Population) -> list[Bound]:
    """The same fraction of half an oscillation of a contact that a bed presses together.

    Eq. 21 is about collisions. Where spheres hardly move, as in a thick fluid, or where a piston
    leans on them, their contacts are stiffer than any collision makes them.
    """
    force = pressing_force_n(scene, layout, population)
    if force == 0.0:
        return []
    fraction, bounds = scene.time.step_fraction, []
    for name, particle, partner in _encounters(scene, layout, population):
        half = pressed_half_period_s(particle, partner, force)
        reason = (
            f"{fraction:g} of half an oscillation of a pressed {name} contact, "
            f"{half:.3g} s under {force:.3g} N"
        )
        bounds.append(Bound(f"pressed {name}", fraction * half, reason))
    return bounds


def _encounters(
    scene: Scene, layout: Layout, population: Population
) -> Iterator[tuple[str, Body, Body]]:
    """The smallest particle with each kind of partner that it can have."""
    particle = particle_body(scene, float(population.particle_radii_m.min()))
    if population.particles > 1:
        yield "particle-particle", particle, particle
    if population.grains and scene.grains is not None:
        # Eq. 21 falls with r*: the largest grain makes the shortest contact.
        radius = float(population.radii_m[population.particles :].max())
        yield "particle-grain", particle, fixed_body(scene, "grains", radius)
    if layout.walls or scene.piston:
        yield "particle-wall", particle, fixed_body(scene, "walls")


def drag_bound(drag: DragPlan) -> Bound:
    """What an explicit drag allows."""
    relaxation = drag.relaxation_s
    reason = f"K dt/m below {LARGEST_DRAG_NUMBER}: a particle relaxes in {relaxation:.3g} s"
    return Bound("drag", LARGEST_DRAG_NUMBER * relaxation, reason)
