"""Drag of the fluid on the particles, Eqs. 17-19, by one of three schemes.

``exact`` writes the full law out for every step: the reference, and by far the most expensive.
``held`` computes the force now and then and keeps it in between. ``implicit`` keeps the coefficient
K and leaves the step itself to the engine's own implicit drag, stable for any K dt / m.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar

from liggghts_driver.effects import costs, drag_law
from liggghts_driver.effects.base import Column, Effect, Refresh, Slot, Weight
from liggghts_driver.effects.drag_kept import KeptDrag
from liggghts_driver.effects.scales import scales_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from liggghts_driver.case import Case
    from liggghts_driver.scene.model import Scene


class Drag(Effect):
    """Drag with a Reynolds-dependent coefficient."""

    name: ClassVar[str] = "drag"
    title: ClassVar[str] = "fluid drag"
    slot: ClassVar[Slot] = "forces"
    order: ClassVar[int] = 1
    without: ClassVar[Mapping[str, Any]] = {"drag.scheme": "none"}

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when there is a fluid."""
        if scene.fluid is None:
            return False, "the scene has no [fluid]"
        if scene.drag.scheme == "none":
            return False, 'drag.scheme = "none"'
        return True, f"a fluid of {scene.fluid.viscosity:g} Pa s"

    def weigh(self, case: Case) -> Weight:
        """The Stokes number; below one a particle follows the fluid."""
        stokes = scales_of(case).stokes
        meaning = "m / K over length / speed"
        return Weight("Stokes number", meaning, stokes, min(1.0, 1.0 / stokes))

    def cost(self, case: Case) -> float:
        """A step of the scheme, and its share of a refresh."""
        scheme = case.time.drag_scheme
        refresh = costs.REFRESH / case.time.refresh_every if case.time.keeps_drag else 0.0
        if scheme == "held" and case.scene.drag.carrier == "addforce":
            return costs.HELD_BY_ADDFORCE + refresh
        return costs.DRAG[scheme] + refresh

    def fragment(self, case: Case) -> str:
        """One fragment for each scheme."""
        return f"effects/drag_{case.time.drag_scheme}.j2"

    def values(self, case: Case) -> dict[str, object]:
        """The law for this scene: slip velocity, Reynolds number, drag factor."""
        fluid = case.scene.fluid
        assert fluid is not None
        bound = drag_law.reynolds_bound(case)
        law: dict[str, object] = {
            "stokes_per_r": 6.0 * math.pi * fluid.viscosity,
            "re_per_r_u": 2.0 * fluid.density / fluid.viscosity,
            "factor": drag_law.drag_factor_formula(bound, "v_re2"),
            "slip": drag_law.slip_formula(case),
            "outside_reason": fluid.velocity_outside,
            "reynolds_bound": f"{bound:g}",
        }
        return law | (KeptDrag(case).values() if case.time.keeps_drag else {})

    def columns(self, case: Case) -> tuple[Column, ...]:  # noqa: ARG002
        """The largest Reynolds number, squared as the deck has it."""
        return (Column("largest_reynolds_squared", "c_largest_re2"),)

    def refresh(self, case: Case) -> Refresh | None:
        """What the scheme renews between its intervals."""
        return KeptDrag(case).refresh() if case.time.keeps_drag else None


def uses_coupling(case: Case) -> bool:
    """Whether the deck asks for the engine's coupling with a fluid code."""
    return case.time.keeps_drag and case.scene.drag.carrier == "coupling"
