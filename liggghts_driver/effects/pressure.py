"""The force of the pressure gradient, constant or to and fro in time.

The schemes whose drag keeps a force carry that of the pressure with it. A gradient that goes to and
fro is carried by the held scheme alone, whose intervals are short beside its period. The implicit
scheme's need not be: particles that relax within an interval would follow the gradient half an
interval late. There it is added at every step, as it is at that instant.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar

from liggghts_driver.effects import costs
from liggghts_driver.effects.base import Effect, Slot, Weight
from liggghts_driver.effects.scales import scales_of, share
from liggghts_driver.physics.drag import pressure_force_n
from liggghts_driver.physics.oscillation import angular_rate_rad_s
from liggghts_driver.scene.swing import swing_period_s

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
        period = scene.pressure.period
        varying = "" if period is None else f"to and fro in {period:g} s, "
        return True, f"{scene.pressure.gradient:g} Pa/m {varying}{where}"

    def weigh(self, case: Case) -> Weight:
        """The pressure force over the largest of the others."""
        scales = scales_of(case)
        others = max(scales.weight_n, scales.carried_n, scales.inertia_n)
        ratio = scales.pressure_n / others if others else math.inf
        meaning = "pressure force over the largest other"
        return Weight("pressure number", meaning, ratio, share(scales.pressure_n, others))

    def cost(self, case: Case) -> float:
        """Nothing where the drag carries it."""
        return 0.0 if is_carried(case) else costs.FORMULA_FORCE

    def fragment(self, case: Case) -> str:
        """None of its own where the drag carries it."""
        return "effects/pressure_carried.j2" if is_carried(case) else "effects/pressure.j2"

    def values(self, case: Case) -> dict[str, object]:
        """Force per cubed radius [N/m3], at its largest, and the share of it at each step."""
        assert case.scene.pressure is not None
        return {
            "force_per_r3": pressure_force_n(1.0, case.scene.pressure.gradient),
            "swing": swing_formula(case),
            "inside_only": case.scene.specimen is not None,
        }


def is_carried(case: Case) -> bool:
    """Whether the drag keeps the pressure force, with what else it keeps."""
    if case.time.drag_scheme == "implicit":
        return not swing_formula(case)
    return case.time.keeps_drag


def swing_formula(case: Case, ahead_steps: float = 0.0) -> str:
    """The share of the largest gradient so many steps ahead, in the engine's words.

    Empty where the gradient is constant, or none.
    """
    period = swing_period_s(case.scene)
    if period is None:
        return ""
    per_step = angular_rate_rad_s(period) * case.time.step_s
    when = f"(step+{ahead_steps!r})" if ahead_steps else "step"
    return f"cos({per_step!r}*{when})"
