"""Attraction of bodies that touch."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar

from liggghts_driver.effects import costs
from liggghts_driver.effects.base import Effect, Slot, Weight
from liggghts_driver.effects.contacts import pairwise
from liggghts_driver.effects.scales import Scales, scales_of, share
from liggghts_driver.physics.contact import Body, pull_off_force_n
from liggghts_driver.scene.elastic import elastic, fixed_body

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from liggghts_driver.case import Case
    from liggghts_driver.scene.model import Scene


class Cohesion(Effect):
    """Cohesion of touching bodies, the engine's simplified Johnson-Kendall-Roberts law (sjkr).

    The attraction is an energy density times the area of the circle in which the two spheres, or
    the sphere and the plane, cut each other. The engine's sjkr takes that area exactly; its sjkr2
    takes 2 pi (2 r*) d for two spheres, twice the area, and the right one for a wall: with one
    energy density it would hold spheres twice as fast as walls, so it is not used here.

    What it cannot do: it acts while bodies overlap and nowhere else. Nothing is attracted across a
    gap, so this is not the near-field force that the paper allows for and takes from its sources,
    a difference of two powers of the distance, alpha_1 r^-beta_1 - alpha_2 r^-beta_2: the engine
    has no such law. Contact ends where it began, at zero overlap, without the neck that the full
    Johnson-Kendall-Roberts theory draws out; and there are no liquid bridges. Friction does not
    grow with it: Coulomb's limit knows the repulsion only.
    """

    name: ClassVar[str] = "cohesion"
    title: ClassVar[str] = "contact cohesion"
    slot: ClassVar[Slot] = "materials"
    order: ClassVar[int] = 3
    without: ClassVar[Mapping[str, Any]] = {"contact.cohesion_energy_density": 0.0}
    contact_words: ClassVar[tuple[str, ...]] = ("cohesion", "sjkr")

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when the energy density is above zero."""
        density = scene.contact.cohesion_energy_density
        if density > 0:
            return True, f"{density:g} J/m3 of contact area (sjkr); none across a gap"
        return False, "no attraction: cohesion energy density 0"

    def weigh(self, case: Case) -> Weight:
        """The Bond number: the strongest pull-off force over the largest of the other forces."""
        scales = scales_of(case)
        density = case.scene.contact.cohesion_energy_density
        particle = _mean_particle(case, scales)
        pull_off = max(pull_off_force_n(particle, b, density) for b in _partners(case, scales))
        others = max(scales.pressure_n, scales.weight_n, scales.carried_n, scales.inertia_n)
        meaning = "pull-off force over the largest other force"
        number = pull_off / others if others else math.inf
        return Weight("Bond number", meaning, number, share(pull_off, others))

    def cost(self, case: Case) -> float:  # noqa: ARG002
        """One more term in every contact."""
        return costs.COHESION

    def values(self, case: Case) -> dict[str, object]:
        """The energy density for every pair of materials."""
        return {"energy_density": pairwise(case, case.scene.contact.cohesion_energy_density)}


def _mean_particle(case: Case, scales: Scales) -> Body:
    return Body(scales.radius_m, scales.mass_kg, *elastic(case.scene, "particles"))


def _partners(case: Case, scales: Scales) -> Iterator[Body]:
    """What a mean particle can stick to: another one, a mean grain, a wall."""
    scene, population = case.scene, case.population
    yield _mean_particle(case, scales)
    if scene.grains is not None and population.grains:
        radius = float(population.radii_m[population.particles :].mean())
        yield fixed_body(scene, "grains", radius)
    if "walls" in case.materials:
        yield fixed_body(scene, "walls")
