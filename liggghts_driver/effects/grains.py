"""Grains that never move."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from liggghts_driver.effects.base import Effect, Slot, Weight
from liggghts_driver.effects.scales import scales_of

if TYPE_CHECKING:
    from liggghts_driver.case import Case
    from liggghts_driver.scene.model import Scene


class FixedGrains(Effect):
    """Grains that never move."""

    name: ClassVar[str] = "grains"
    title: ClassVar[str] = "fixed grains"
    slot: ClassVar[Slot] = "boundaries"

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when the scene has a specimen or single grains."""
        if scene.specimen is not None:
            return True, "the specimen is made of them"
        if any(sphere.kind == "grain" for sphere in scene.spheres):
            return True, "the scene has fixed spheres"
        return False, "no specimen and no fixed sphere"

    def weigh(self, case: Case) -> Weight:
        """Size of the grains over that of the particles."""
        grains = case.population.radii_m[case.population.particles :]
        ratio = float(grains.mean()) / scales_of(case).radius_m
        return Weight("size ratio", "mean grain radius over mean particle radius", ratio)
