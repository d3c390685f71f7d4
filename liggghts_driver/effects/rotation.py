"""Rotation of the particles."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from liggghts_driver.effects.base import Effect, Slot

if TYPE_CHECKING:
    from liggghts_driver.scene.model import Scene


class Rotation(Effect):
    """Integration of the angular velocities."""

    name: ClassVar[str] = "rotation"
    title: ClassVar[str] = "rotation"
    slot: ClassVar[Slot] = "integration"

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when something can turn a particle."""
        if scene.contact.friction > 0:
            return True, "friction exerts torques"
        return False, "no friction, so no torque: angular velocities stay as they are"
