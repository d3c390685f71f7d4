"""How fast anything in a scene can become: the speeds that the time step must resolve."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.contacts import contacts_at, energies_j
from liggghts_driver.physics.drag import free_flight_speed_m_s
from liggghts_driver.physics.oscillation import pushes
from liggghts_driver.physics.spheres import sphere_volume_m3
from liggghts_driver.population import Population, single_spheres
from liggghts_driver.prediction import pore_velocity_m_s

if TYPE_CHECKING:
    from liggghts_driver.scene.layout import Layout
    from liggghts_driver.scene.model import Scene


#: A scene in which nothing can move is bounded as if things moved at this speed.
_SLOWEST_M_S = 1e-6


@dataclass(frozen=True)
class _Singles:
    """What a case would be made of with nothing but the spheres that the scene places itself."""

    scene: Scene
    layout: Layout
    population: Population


def speed_bound_m_s(scene: Scene, layout: Layout, population: Population) -> float:
    """A relative speed that contacts of this scene are not expected to exceed [m/s].

    The sum of what each cause could give alone: the piston over its longest free way, the fluid,
    the free flight under the pressure gradient, gravity over the height, the initial speeds, and
    what contacts that overlap at the start can give; twice that, since two particles may meet
    head-on.
    """
    causes = (
        _piston_speed(scene, layout),
        own_fluid_speed_m_s(scene),
        _driven_speed(scene, layout, population),
        _thrown(population) * _initial_speed(population),
        _sprung_speed(scene, layout),
    )
    return max(2.0 * sum(causes), _SLOWEST_M_S)


def _piston_speed(scene: Scene, layout: Layout) -> float:
    if scene.piston is None:
        return 0.0
    way = layout.fill_high[0] - layout.fill_low[0]
    free = math.sqrt(2.0 * scene.piston.acceleration * way)
    return min(free, scene.piston.acceleration * scene.time.duration)


def own_fluid_speed_m_s(scene: Scene) -> float:
    """The largest speed of a fluid that does not go with the piston."""
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
        return max(own_fluid_speed_m_s(scene), _piston_speed(scene, layout))
    return own_fluid_speed_m_s(scene)


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
    pressure, weight = driven_acceleration_m_s2(scene)
    diagonal = math.dist(layout.low, layout.high)
    # A gradient that goes to and fro may do its work in each half period, one way and the other.
    times = pushes(scene.time.duration, scene.pressure.period) if scene.pressure else 1
    falling = math.sqrt(2.0 * (times * pressure + weight) * diagonal)
    fluid = scene.dragging_fluid
    if fluid is None:
        return falling
    force = density * sphere_volume_m3(radius) * (pressure + weight)
    return min(falling, free_flight_speed_m_s(fluid.density, fluid.viscosity, radius, force))


def driven_acceleration_m_s2(scene: Scene) -> tuple[float, float]:
    """What the pressure gradient (Eq. 20) and the buoyed weight give every particle."""
    gradient = abs(scene.pressure.gradient) if scene.pressure else 0.0
    gravity = math.hypot(*scene.gravity.acceleration) if scene.gravity else 0.0
    # A fluid denser than the particles drives them upwards, with more than their weight.
    buoyant = abs(1.0 - scene.buoyed_share)
    return 1.5 * gradient / scene.particles.density, buoyant * gravity


def _initial_speed(population: Population) -> float:
    """Half the sum of the two largest initial speeds: twice this is the fastest they can meet."""
    speeds = np.sort(np.linalg.norm(population.velocities_m_s, axis=1))
    return float(speeds[-2:].sum()) / 2.0


def _thrown(population: Population) -> float:
    """How many times faster than they met the lightest leaves the heaviest: 2 M / (M + m).

    1 for spheres of one size, 2 at most. Two that meet head-on are counted already.
    """
    radii = population.particle_radii_m
    return 2.0 / (1.0 + float((radii.min() / radii.max()) ** 3)) if len(radii) else 1.0


def _sprung_speed(scene: Scene, layout: Layout) -> float:
    """Half the speed at which two part whose springs are pressed together at the start.

    (m* / 2) v^2 is at most the energy of all contacts of the one that has most for its mass; m*
    is half the mass of either of two that are alike. Only spheres that the scene itself places can
    overlap.
    """
    if not any(sphere.kind == "particle" for sphere in scene.spheres):
        return 0.0
    singles = _Singles(scene, layout, single_spheres(scene))
    population = singles.population
    count = population.particles
    energy = np.zeros(len(population.radii_m))
    piston_x = None if scene.piston is None else layout.low[0]
    for some in contacts_at(population.centres_m[:count], singles, piston_x_m=piston_x):
        each = energies_j(some, singles) if len(some.overlaps_m) else 0.0
        np.add.at(energy, some.first, each)
        if some.kind == "particles":
            np.add.at(energy, some.second, each)
    masses = scene.particles.density * population.particle_volumes_m3
    return float(np.sqrt(4.0 * energy[:count] / masses).max(initial=0.0)) / 2.0
