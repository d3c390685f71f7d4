"""Drag of the fluid on the particles, Eqs. 17-19, by one of three schemes.

``exact`` writes the full law out for every step: the reference, and by far the most expensive.
``held`` keeps the coefficient K for some steps. ``implicit`` does the same and leaves the step
itself to the engine's own implicit drag: nearly free, and stable for any K dt / m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from liggghts_driver.effects import drag_law
from liggghts_driver.effects.base import Column, Effect, Refresh, Slot
from liggghts_driver.physics.drag import pressure_force_n

if TYPE_CHECKING:
    from liggghts_driver.case import Case
    from liggghts_driver.scene.model import Scene


class Drag(Effect):
    """Drag with a Reynolds-dependent coefficient."""

    name: ClassVar[str] = "drag"
    title: ClassVar[str] = "fluid drag"
    slot: ClassVar[Slot] = "forces"

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when there is a fluid."""
        if scene.fluid is None:
            return False, "the scene has no [fluid]"
        return True, f"a fluid of {scene.fluid.viscosity:g} Pa s; {scene.drag.scheme} scheme"

    def fragment(self, scene: Scene) -> str:
        """One fragment for each scheme."""
        return f"effects/drag_{scene.drag.scheme}.j2"

    def values(self, case: Case) -> dict[str, object]:
        """The law for this scene: slip velocity, Reynolds number, drag factor."""
        fluid = case.scene.fluid
        assert fluid is not None
        bound = drag_law.reynolds_bound(case)
        law: dict[str, object] = {
            "stokes_per_r": 6.0 * math.pi * fluid.viscosity,
            "re_per_r_u": 2.0 * fluid.density / fluid.viscosity,
            "factor": drag_law.drag_factor_formula(bound),
            "slip": drag_law.slip_formula(case),
            "outside_reason": fluid.velocity_outside,
            "reynolds_bound": f"{bound:g}",
        }
        if case.scene.drag.scheme == "held":
            law["refresh_every"] = case.time.refresh_every
        if case.scene.drag.scheme == "implicit":
            law |= _ImplicitPlan.of(case).values()
        return law

    def columns(self, case: Case) -> tuple[Column, ...]:  # noqa: ARG002
        """The largest Reynolds number, squared as the deck has it."""
        return (Column("largest_reynolds_squared", "c_largest_re2"),)

    def refresh(self, case: Case) -> Refresh | None:
        """What the scheme renews between its intervals."""
        scheme = case.scene.drag.scheme
        if scheme == "implicit":
            return _ImplicitPlan.of(case).refresh()
        if scheme == "held":
            command = "set group particles property/atom coefficient v_drag"
            return Refresh(case.time.refresh_every, (), (command,))
        return None


@dataclass(frozen=True)
class _ImplicitPlan:
    """Which per-atom properties of the implicit scheme are set once, and which are renewed."""

    case: Case
    specimen: bool
    moving: str
    inside: float
    pressure_per_r3: float

    @classmethod
    def of(cls, case: Case) -> _ImplicitPlan:
        pressure = case.scene.pressure
        return cls(
            case=case,
            specimen=case.scene.specimen is not None,
            moving=_midway(case),
            inside=drag_law.inside_velocity_m_s(case),
            pressure_per_r3=pressure_force_n(1.0, pressure.gradient) if pressure else 0.0,
        )

    def values(self) -> dict[str, object]:
        in_motion = self.moving != drag_law.AT_REST or self.inside != 0.0
        return {
            "slip": "vx-f_uf[1]" if in_motion else "vx",
            "moving": self.moving,
            "in_motion": self.moving != drag_law.AT_REST,
            "pressure_per_r3": self.pressure_per_r3,
            "regions": self.specimen,
        }

    def refresh(self) -> Refresh:
        once: list[str] = []
        again: list[str] = []
        unsteady = self.specimen or drag_law.outside_acceleration_formula(self.case) != "0.0"
        (again if unsteady else once).extend(self._fluid())
        (again if self.specimen else once).extend(self._pressure())
        stokes = drag_law.reynolds_bound(self.case) <= 1.0
        (once if stokes else again).append("set group particles property/atom Ksl v_drag")
        return Refresh(self.case.time.refresh_every, tuple(once), tuple(again))

    def _fluid(self) -> list[str]:
        outside = "outside" if self.specimen else None
        commands = []
        if self.moving != drag_law.AT_REST:
            commands.append(_set(outside, "uf", "$(v_fluid_velocity) 0.0 0.0"))
        elif self.inside:
            commands.append(_set(outside, "uf", "0.0 0.0 0.0"))
        if self.specimen and commands:
            commands.append(_set("inside", "uf", f"{self.inside!r} 0.0 0.0"))
        return commands

    def _pressure(self) -> list[str]:
        if not self.pressure_per_r3:
            return []
        force = "v_pressure_x v_zero v_zero"
        if not self.specimen:
            return [_set(None, "dragforce", force)]
        return [_set("inside", "dragforce", force), _set("outside", "dragforce", "0.0 0.0 0.0")]


def _set(region: str | None, name: str, value: str) -> str:
    where = f"region {region}" if region else "group particles"
    return f"set {where} property/atom {name} {value}"


def _midway(case: Case) -> str:
    """Fluid velocity outside at the middle of the coming interval, in the engine's words."""
    now = drag_law.outside_velocity_formula(case)
    change = drag_law.outside_acceleration_formula(case)
    if change == drag_law.AT_REST:
        return now
    half = 0.5 * case.time.refresh_every * case.time.step_s
    return f"{now}+{change}*{half!r}"
