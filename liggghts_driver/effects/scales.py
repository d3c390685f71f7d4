"""The scales of a case by which effects are weighed: a mean particle, its forces and its speed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.drag_plan import drag_relaxation_s
from liggghts_driver.physics.drag import pressure_force_n
from liggghts_driver.physics.spheres import sphere_volume_m3
from liggghts_driver.prediction import pore_velocity_m_s
from liggghts_driver.speeds import fluid_speed_m_s

if TYPE_CHECKING:
    from liggghts_driver.case import Case


#: How much more than its coefficient friction changes a flow in which particles pile up: measured
#: on the small case (docs/effects.md), 6.6 times for friction 0.2, 5 times for rolling resistance
#: 0.05; rounded up, for an estimate should be too large rather than too small.
PILED_UP = 10.0


@dataclass(frozen=True)
class Scales:
    """A particle of the mean radius, and what acts on it.

    Attributes
    ----------
    radius_m, mass_kg
        Of the mean particle.
    length_m
        Of the specimen, or of the box's longest edge.
    speed_m_s
        The largest that the case is expected to reach, relative to the fluid.
    relaxation_s
        m / K of the drag at that speed; infinite without a fluid.
    pressure_n, weight_n
        Pressure force (Eq. 20; at its largest, if it goes to and fro) and weight; zero where there
        is none.
    carried_n
        Drag of the moving fluid on the particle at rest: inside the specimen, where the flow is
        measured, or in the box; zero where there is none.
    """

    radius_m: float
    mass_kg: float
    length_m: float
    speed_m_s: float
    relaxation_s: float
    pressure_n: float
    weight_n: float
    carried_n: float

    @property
    def stokes(self) -> float:
        """Stokes number: way on which drag stops the particle, over the length."""
        return self.relaxation_s * self.speed_m_s / self.length_m

    @property
    def inertia_n(self) -> float:
        """Force that stops the particle within the length, m v^2 / L; zero where drag does it."""
        if self.stokes < 1.0:
            return 0.0
        return self.mass_kg * self.speed_m_s**2 / self.length_m


def scales_of(case: Case) -> Scales:
    """The scales of a case; a scene without particles is weighed as if it had its grains."""
    scene, population = case.scene, case.population
    radii = population.particle_radii_m if population.particles else population.radii_m
    radius = float(np.mean(radii))
    mass = scene.particles.density * sphere_volume_m3(radius)
    extent = [high - low for low, high in zip(case.layout.low, case.layout.high, strict=True)]
    speed = case.speed_bound_m_s / 2.0
    drags = case.time.drag_scheme != "" and population.particles > 0
    gradient = scene.pressure.gradient if scene.pressure else 0.0
    gravity = scene.gravity.acceleration if scene.gravity else (0.0, 0.0, 0.0)
    return Scales(
        radius_m=radius,
        mass_kg=mass,
        length_m=scene.specimen.length if scene.specimen else max(extent),
        speed_m_s=speed,
        relaxation_s=drag_relaxation_s(scene, population, speed) if drags else math.inf,
        pressure_n=abs(pressure_force_n(radius, gradient)),
        weight_n=mass * math.hypot(*gravity),
        carried_n=_carried_n(case, mass) if drags else 0.0,
    )


def _carried_n(case: Case, mass_kg: float) -> float:
    scene = case.scene
    if scene.specimen is None:
        speed = fluid_speed_m_s(scene, case.layout)
    else:
        inside = scene.fluid is not None and scene.fluid.velocity_inside == "pore"
        speed = abs(pore_velocity_m_s(scene)) if inside else 0.0
    if speed == 0.0:
        return 0.0
    return mass_kg * speed / drag_relaxation_s(scene, case.population, speed)


def share(force_n: float, others_n: float) -> float:
    """How much of the motion a force makes up beside the largest of the others, 0 to 1."""
    return force_n / max(force_n, others_n) if force_n > 0 else 0.0
