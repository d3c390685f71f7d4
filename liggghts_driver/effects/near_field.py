"""Attraction across a gap."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar

from liggghts_driver.effects import costs
from liggghts_driver.effects.base import Effect, Overlay, Slot, Weight
from liggghts_driver.effects.scales import scales_of, share

if TYPE_CHECKING:
    from collections.abc import Mapping

    from liggghts_driver.case import Case
    from liggghts_driver.scene.model import Scene


class NearField(Effect):
    """The engine's pair style ``soft``, laid over the contacts with a negative strength.

    Two particles whose centres are at a distance d < R attract each other with
    F sin(pi d / R) / sin(pi 2 r / R): F where two mean particles touch, zero at R = 2 r + reach.

    What it cannot do: it is a sine and not the power law that the paper takes from its sources,
    alpha_1 d^-beta_1 - alpha_2 d^-beta_2, which this engine has not. It goes with the distance of
    the centres, so its reach over the surfaces is shorter for particles larger than the mean and
    longer for smaller ones. Particles attract each other only: not grains, walls or the piston.
    """

    name: ClassVar[str] = "near_field"
    title: ClassVar[str] = "near-field attraction"
    slot: ClassVar[Slot] = "materials"
    order: ClassVar[int] = 4
    without: ClassVar[Mapping[str, Any]] = {"near_field": None}

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when the scene has a near field."""
        if scene.near_field is None:
            return False, "the scene has no [near_field]"
        return True, f"{scene.near_field.force:g} N at contact, a sine of the distance (soft)"

    def weigh(self, case: Case) -> Weight:
        """Attraction at contact over the largest of the other forces."""
        assert case.scene.near_field is not None
        scales, force = scales_of(case), case.scene.near_field.force
        others = max(scales.pressure_n, scales.weight_n, scales.carried_n, scales.inertia_n)
        number = force / others if others else math.inf
        meaning = "attraction at contact over the largest other force"
        return Weight("near-field number", meaning, number, share(force, others))

    def cost(self, case: Case) -> float:  # noqa: ARG002
        """A second force for every pair of neighbours."""
        return costs.NEAR_FIELD

    def overlay(self, case: Case) -> Overlay:
        """Strength and range for two particles; every other pair has strength zero."""
        near = case.scene.near_field
        assert near is not None
        diameter = 2.0 * scales_of(case).radius_m
        end = diameter + near.reach
        strength = near.force * end / (math.pi * math.sin(math.pi * diameter / end))
        kind = case.type_of("particles")
        return Overlay(
            style=f"soft {end!r}",
            coefficients=(f"* * soft 0.0 {end!r}", f"{kind} {kind} soft {-strength!r} {end!r}"),
        )
