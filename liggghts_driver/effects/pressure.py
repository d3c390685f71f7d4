"""The force of the pressure gradient."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar

from liggghts_driver.effects import costs
from liggghts_driver.effects.base import Effect, Slot, Weight
from liggghts_driver.effects.scales import scales_of, share
from liggghts_driver.physics.drag import pressure_force_n

if TYPE_CHECKING:
    from collections.abc import Mapping

    from liggghts_driver.case import Case
    from liggghts_driver.scene.model import Scene


class PressureForce(Effect):
    """The force of the pressure gradient on a particle, Eq. 20: 2 pi r^3 |grad p|."""

    name: ClassVar[str] = "pressure"
    title: ClassVar[str] = "pressure force"
    slot: ClassVar[Slot] = "forces"
    without: ClassVar[Mapping[str, Any]] = {"pressure": None}

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when there is a gradient."""
        if scene.pressure is None or scene.pressure.gradient == 0:
            return False, "no pressure gradient"
        where = "everywhere"
        if scene.specimen is not None:
            beyond = " and behind its open exit" if scene.specimen.exit == "open" else ""
            where = f"inside the specimen{beyond}"
        return True, f"{scene.pressure.gradient:g} Pa/m {where}"

    def weigh(self, case: Case) -> Weight:
        """The pressure force over the largest of the others."""
        scales = scales_of(case)
        others = max(scales.weight_n, scales.carried_n, scales.inertia_n)
        ratio = scales.pressure_n / others if others else math.inf
        meaning = "pressure force over the largest other"
        return Weight("pressure number", meaning, ratio, share(scales.pressure_n, others))

    def cost(self, case: Case) -> float:
        """Nothing where the drag carries it."""
        return 0.0 if case.time.keeps_drag else costs.FORMULA_FORCE

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
