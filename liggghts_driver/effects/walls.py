"""Plane walls."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from liggghts_driver.effects import costs
from liggghts_driver.effects.base import Effect, Slot, Weight
from liggghts_driver.effects.scales import scales_of

if TYPE_CHECKING:
    from liggghts_driver.case import Case
    from liggghts_driver.scene.model import Scene


class Walls(Effect):
    """Plane walls."""

    name: ClassVar[str] = "walls"
    title: ClassVar[str] = "walls"
    slot: ClassVar[Slot] = "boundaries"
    order: ClassVar[int] = 1

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when a face of the domain is a wall."""
        if scene.specimen is not None:
            return True, "the specimen and the channel before it are enclosed"
        if scene.box is not None and scene.box.walls:
            return True, f"box.walls = {', '.join(scene.box.walls)}"
        return False, "no face of the box is a wall"

    def weigh(self, case: Case) -> Weight:
        """Particle diameters between the nearest two opposite faces of the domain."""
        sides = zip(case.layout.low, case.layout.high, strict=True)
        narrowest = min(high - low for low, high in sides)
        ratio = 2.0 * scales_of(case).radius_m / narrowest
        return Weight("wall layer", "particle diameter over the domain's narrowest side", ratio)

    def cost(self, case: Case) -> float:
        """A layer of particles at each wall."""
        return costs.WALL * len(case.layout.walls)

    def values(self, case: Case) -> dict[str, object]:
        """The planes: axis, place and name of each."""
        planes = []
        for face in case.layout.walls:
            axis = "xyz".index(face[0])
            corner = case.layout.low if face[1] == "-" else case.layout.high
            side = "low" if face[1] == "-" else "high"
            planes.append({"axis": face[0], "at": corner[axis], "name": f"wall_{face[0]}_{side}"})
        return {"planes": planes, "type": case.type_of("walls")}
