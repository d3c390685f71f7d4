"""What presses the contacts of a bed together: an estimate of the largest force on one of them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.physics.drag import drag_coefficient_n_s_m
from liggghts_driver.scene.layout import moving_count, particle_fraction
from liggghts_driver.speeds import driven_acceleration_m_s2, own_fluid_speed_m_s

if TYPE_CHECKING:
    from collections.abc import Iterator

    from liggghts_driver.population import Population
    from liggghts_driver.scene.layout import Layout
    from liggghts_driver.scene.model import Scene

#: The largest of the contact forces in a bed are a few times their mean (force chains). The step
#: goes with the power -1/6 of the force: twice as much would shorten it by a tenth.
_FORCE_CHAINS = 4.0


def piston_mass_kg(scene: Scene, layout: Layout, particle_volume_m3: float) -> float:
    """Mass of the piston: as given, or that of the suspension before it.

    ``particle_volume_m3`` is that of all particles together.
    """
    assert scene.piston is not None
    if scene.piston.mass is not None:
        return scene.piston.mass
    particles = particle_volume_m3 * scene.particles.density
    if scene.fluid is None:
        return particles
    fraction = particle_fraction(scene, layout)
    volume = particle_volume_m3 / fraction
    return particles + scene.fluid.density * volume * (1.0 - fraction)


def pressing_force_n(scene: Scene, layout: Layout, population: Population) -> float:
    """The force that one contact of a packed bed may have to bear; 0 where nothing presses.

    Everything that drives is taken to lean on one layer of spheres across the channel, as densely
    as spheres of the mean radius fill a square lattice, or on all the spheres there are where
    those are fewer.
    """
    if not population.particles:
        return 0.0
    radius = float(population.particle_radii_m.mean())
    # Not those of the population, which may be a few that stand for all.
    number = moving_count(scene, layout)
    force = sum(
        total / min(number, max(1.0, area / (2.0 * radius) ** 2))
        for total, area in _loads(scene, layout, population, number)
    )
    return _FORCE_CHAINS * force


def _loads(
    scene: Scene, layout: Layout, population: Population, number: int
) -> Iterator[tuple[float, float]]:
    """Forces on all spheres together [N], each with the area across it [m2]."""
    sides = np.subtract(layout.high, layout.low)
    along = float(sides[1] * sides[2])
    volume = number * float(population.particle_volumes_m3.mean())
    mass = scene.particles.density * volume
    if scene.piston is not None:
        yield piston_mass_kg(scene, layout, volume) * scene.piston.acceleration, along
    pressure, weight = driven_acceleration_m_s2(scene)
    yield mass * pressure, along
    if scene.gravity is not None:
        axis = int(np.argmax(np.abs(scene.gravity.acceleration)))
        yield mass * weight, float(math.prod(np.delete(sides, axis)))
    fluid = scene.dragging_fluid
    if fluid is not None:
        speed, radii = own_fluid_speed_m_s(scene), population.particle_radii_m
        drag = drag_coefficient_n_s_m(fluid.density, fluid.viscosity, radii, speed)
        yield number * float(drag.mean()) * speed, along
