"""The energy budget of a scene: an upper bound on what its particles can ever hold.

Nothing in a scene makes energy but what drives it, so the sum of what each drive can have given,
from the start to any instant, is never exceeded by the kinetic energy of the particles and the
springs of their contacts together. Where it is, the integration itself made the difference. Each
item is an upper bound by itself:

start
    The kinetic energy at the start, of translation and spin, and that of contacts that overlap.
weight, pressure
    Constant forces along the channel's axes: the force on all particles over the channel's length,
    for a particle that is anywhere in the channel cannot have come farther along the force. A
    pressure gradient that goes to and fro may do that again in each of its half periods, one way
    and the other.
piston
    Its constant force M a over its way, which is at most the channel's length and, as everything
    only holds it up, a T^2 / 2.
fluid
    Drag draws a particle towards the fluid's velocity and no further: M v_f^2 / 2 for all of them.
    Where they are held up, drag loads the contacts instead: a column whose contacts stay within
    ``contact.largest_overlap`` shortens by at most that share of its length, over which all drag
    forces do work.
cohesion
    C times the area of the circle of contact over an overlap of ``contact.largest_overlap``, for
    the twelve neighbours that a sphere can have.

``MARGIN`` is for what these leave out: small particles follow the fluid more quickly than large
ones and push them, and an elastic contact is integrated with a small error. An unstable run passes
any margin within a few contacts, a sound one stays far below the budget itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.contacts import contacts_at, elastic_energy_j
from liggghts_driver.effects import active_effects
from liggghts_driver.physics.drag import drag_coefficient_n_s_m
from liggghts_driver.physics.oscillation import pushes
from liggghts_driver.physics.spheres import INERTIA
from liggghts_driver.speeds import fluid_speed_m_s

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from liggghts_driver.case import Case

#: A run holds at most this many times its budget.
MARGIN = 4.0
#: Where nothing drives anything the budget is no estimate, and this is for the integration alone.
#: With a tenth of a contact as step the energy of an elastic contact is off by 2 % at most while it
#: lasts, and of 27 elastic spheres in a box by 0.4 % in 2 s; with a fifth that becomes 12 %.
MARGIN_UNDRIVEN = 1.05
_NEIGHBOURS = 12
#: A scene in which nothing drives anything is given this speed, which is rounding's.
_SLOWEST_M_S = 1e-6
#: Effects whose energy is budgeted, or that only take energy. With any other there is no budget.
_KNOWN = frozenset({
    "contacts", "cohesion", "friction", "rolling", "rotation", "walls", "grains", "piston",
    "drag", "pressure", "gravity", "buoyancy",
})  # fmt: skip


@dataclass(frozen=True)
class Budget:
    """What each cause can have given the particles, name to energy [J]."""

    items_j: Mapping[str, float]

    @property
    def limit_j(self) -> float:
        """The energy above which a run is unstable."""
        return MARGIN * sum(self.items_j.values())

    @property
    def undriven(self) -> bool:
        """Whether nothing but the start gives the particles any energy."""
        return not any(energy for name, energy in self.items_j.items() if name != "start")

    def __str__(self) -> str:
        most = max(self.items_j, key=lambda name: self.items_j[name])
        given = sum(self.items_j.values())
        return f"{MARGIN:g} times what start and drives can give, {given:.3g} J, most of it {most}"


def energy_budget(case: Case) -> Budget | None:
    """The budget of a case; None with a near field or an effect that this module does not know."""
    if not {effect.name for effect in active_effects(case.scene)} <= _KNOWN:
        return None
    return Budget(dict(_items(case)))


def _items(case: Case) -> Iterator[tuple[str, float]]:
    scene, population = case.scene, case.population
    mass = scene.particles.density * population.particle_volumes_m3
    extent = np.subtract(case.layout.high, case.layout.low)
    yield "start", _start_j(case) + float(mass.sum()) * _SLOWEST_M_S**2 / 2.0
    if scene.gravity is not None:
        fall = float(np.abs(scene.gravity.acceleration) @ extent)
        yield "weight", abs(1.0 - scene.buoyed_share) * float(mass.sum()) * fall
    if scene.pressure is not None:
        force = 1.5 * abs(scene.pressure.gradient) * float(population.particle_volumes_m3.sum())
        times = pushes(scene.time.duration, scene.pressure.period)
        yield "pressure", times * force * float(extent[0])
    if scene.piston is not None:
        way = min(float(extent[0]), scene.piston.acceleration * scene.time.duration**2 / 2.0)
        yield "piston", case.piston_mass_kg * scene.piston.acceleration * way
    if scene.dragging_fluid is not None:
        yield "fluid", _fluid_j(case, float(mass.sum()), float(extent[0]))
    density = scene.contact.cohesion_energy_density
    if density:
        depths = scene.contact.largest_overlap * population.particle_radii_m
        areas = math.pi * population.particle_radii_m * depths
        yield "cohesion", _NEIGHBOURS * density * float((areas * depths).sum())


def _start_j(case: Case) -> float:
    population = case.population
    count = population.particles
    mass = case.scene.particles.density * population.particle_volumes_m3
    speed2 = (population.velocities_m_s[:count] ** 2).sum(axis=1)
    spin2 = (population.spins_rad_s[:count] ** 2).sum(axis=1)
    moving = mass * (speed2 + INERTIA * population.particle_radii_m**2 * spin2)
    contacts = contacts_at(population.centres_m[:count], case)
    return float(moving.sum()) / 2.0 + elastic_energy_j(contacts, case)


def _fluid_j(case: Case, mass_kg: float, length_m: float) -> float:
    fluid = case.scene.dragging_fluid
    assert fluid is not None
    speed = fluid_speed_m_s(case.scene, case.layout)
    radii = case.population.particle_radii_m
    drag = drag_coefficient_n_s_m(fluid.density, fluid.viscosity, radii, speed)
    shortening = case.scene.contact.largest_overlap * length_m
    return mass_kg * speed**2 / 2.0 + float(drag.sum()) * speed * shortening
