"""The weight of the fluid that a particle displaces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from liggghts_driver.effects import costs
from liggghts_driver.effects.base import Effect, Slot, Weight
from liggghts_driver.effects.gravity import uniform_force
from liggghts_driver.effects.scales import scales_of, share

if TYPE_CHECKING:
    from collections.abc import Mapping

    from liggghts_driver.case import Case
    from liggghts_driver.scene.model import Scene


class Buoyancy(Effect):
    """The weight of the fluid that a particle displaces."""

    name: ClassVar[str] = "buoyancy"
    title: ClassVar[str] = "buoyancy"
    slot: ClassVar[Slot] = "forces"
    order: ClassVar[int] = 3
    needs: ClassVar[tuple[str, ...]] = ("gravity",)
    without: ClassVar[Mapping[str, Any]] = {"gravity.buoyancy": False}

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when there is both gravity and a fluid."""
        if scene.gravity is None or not any(scene.gravity.acceleration):
            return False, "no gravity, so no hydrostatic pressure"
        if scene.fluid is None:
            return False, "no fluid"
        if not scene.gravity.buoyancy:
            return False, "gravity.buoyancy = false"
        ratio = scene.fluid.density / scene.particles.density
        return True, f"the fluid carries {ratio:.3g} of the particles' weight"

    def weigh(self, case: Case) -> Weight:
        """The weight of the displaced fluid over the particle's."""
        scales = scales_of(case)
        assert case.scene.fluid is not None
        ratio = case.scene.fluid.density / case.scene.particles.density
        others = max(scales.weight_n, scales.pressure_n, scales.carried_n, scales.inertia_n)
        meaning = "weight of the displaced fluid over the particle's"
        return Weight("density ratio", meaning, ratio, share(ratio * scales.weight_n, others))

    def cost(self, case: Case) -> float:  # noqa: ARG002
        """The engine's own uniform force."""
        return costs.UNIFORM_FORCE

    def values(self, case: Case) -> dict[str, object]:
        """As gravity, upwards: every particle has one density, so it is one acceleration."""
        assert case.scene.fluid is not None
        return uniform_force(case, -case.scene.fluid.density / case.scene.particles.density)
