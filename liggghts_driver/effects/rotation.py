"""Rotation of the particles."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from liggghts_driver.effects.base import Effect, Slot, Weight

if TYPE_CHECKING:
    from liggghts_driver.case import Case
    from liggghts_driver.scene.model import Scene


class Rotation(Effect):
    """Integration of the angular velocities."""

    name: ClassVar[str] = "rotation"
    title: ClassVar[str] = "rotation"
    slot: ClassVar[Slot] = "integration"
    needs: ClassVar[tuple[str, ...]] = ("friction",)

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when something can turn a particle."""
        if scene.contact.friction > 0:
            return True, "friction exerts torques"
        return False, "no friction, so no torque: angular velocities stay as they are"

    def weigh(self, case: Case) -> Weight:  # noqa: ARG002
        """What a sphere that begins to roll loses of its speed."""
        return Weight("rolling loss", "speed that goes into rolling, 2/7", 2.0 / 7.0)
