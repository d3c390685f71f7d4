"""Forces on the particles that need no partner: pressure, gravity, buoyancy; and rotation."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar

from liggghts_driver.effects.base import Effect, Slot
from liggghts_driver.physics.drag import pressure_force_n

if TYPE_CHECKING:
    from liggghts_driver.case import Case
    from liggghts_driver.scene.model import Scene


class PressureForce(Effect):
    """The force of the pressure gradient on a particle, Eq. 20: 2 pi r^3 |grad p|."""

    name: ClassVar[str] = "pressure"
    title: ClassVar[str] = "pressure force"
    slot: ClassVar[Slot] = "forces"

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when there is a gradient."""
        if scene.pressure is None or scene.pressure.gradient == 0:
            return False, "no pressure gradient"
        where = "everywhere"
        if scene.specimen is not None:
            beyond = " and behind its open exit" if scene.specimen.exit == "open" else ""
            where = f"inside the specimen{beyond}"
        return True, f"{scene.pressure.gradient:g} Pa/m {where}"

    def fragment(self, case: Case) -> str:
        """None of its own where the drag carries it: all but the exact scheme keep a force."""
        carried = case.time.keeps_drag
        return "effects/pressure_carried.j2" if carried else "effects/pressure.j2"

    def values(self, case: Case) -> dict[str, object]:
        """Force per cubed radius [N/m3]."""
        assert case.scene.pressure is not None
        return {
            "force_per_r3": pressure_force_n(1.0, case.scene.pressure.gradient),
            "inside_only": case.scene.specimen is not None,
        }


class Gravity(Effect):
    """The weight of the particles."""

    name: ClassVar[str] = "gravity"
    title: ClassVar[str] = "gravity"
    slot: ClassVar[Slot] = "forces"

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when the scene has an acceleration of gravity."""
        if scene.gravity is None or not any(scene.gravity.acceleration):
            return False, "the scene has no [gravity]"
        return True, f"{math.hypot(*scene.gravity.acceleration):g} m/s2"

    def values(self, case: Case) -> dict[str, object]:
        """Magnitude and direction."""
        return _uniform(case, 1.0)


class Buoyancy(Effect):
    """The weight of the fluid that a particle displaces."""

    name: ClassVar[str] = "buoyancy"
    title: ClassVar[str] = "buoyancy"
    slot: ClassVar[Slot] = "forces"

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when there is both gravity and a fluid."""
        if scene.gravity is None or not any(scene.gravity.acceleration):
            return False, "no gravity, so no hydrostatic pressure"
        if scene.fluid is None:
            return False, "no fluid"
        ratio = scene.fluid.density / scene.particles.density
        return True, f"the fluid carries {ratio:.3g} of the particles' weight"

    def values(self, case: Case) -> dict[str, object]:
        """As gravity, upwards: every particle has one density, so it is one acceleration."""
        assert case.scene.fluid is not None
        return _uniform(case, -case.scene.fluid.density / case.scene.particles.density)


def _uniform(case: Case, factor: float) -> dict[str, object]:
    assert case.scene.gravity is not None
    x, y, z = (factor * a for a in case.scene.gravity.acceleration)
    return {"magnitude": math.hypot(x, y, z), "x": x, "y": y, "z": z}
