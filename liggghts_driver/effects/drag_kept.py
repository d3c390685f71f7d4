"""Drag that is kept between refreshes: what is set once, what again, by which formulas.

Everything kept for M steps is taken at the middle of them. A particle's velocity there is
extrapolated from those at this refresh and at the last, about v + (v - v_last) / 2 (Adams and
Bashforth's second formula): second order in the interval; and a collision since the last refresh,
half an interval ago on average, which the last force knew nothing of, is made good for on average.

The engine's step kicks with half of the old force and half of the new, so what is refreshed takes
effect half a step late: the middle is (M + 1) / 2 steps ahead. Where particles relax within an
interval (the implicit scheme allows it), there is no trend to go on with, and the present counts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver.effects import drag_law
from liggghts_driver.effects.base import Refresh
from liggghts_driver.effects.pressure import is_carried, swing_formula
from liggghts_driver.physics.drag import pressure_force_n

if TYPE_CHECKING:
    from liggghts_driver.case import Case


@dataclass(frozen=True)
class KeptDrag:
    """The held or the implicit scheme of a case."""

    case: Case

    @property
    def held(self) -> bool:
        """Whether whole forces are kept, not coefficients."""
        return self.case.time.drag_scheme == "held"

    @property
    def specimen(self) -> bool:
        """Whether the fluid and the pressure differ before and in a specimen."""
        return self.case.scene.specimen is not None

    @property
    def stokes(self) -> bool:
        """Whether K is constant: no particle comes above Re = 1."""
        return drag_law.reynolds_bound(self.case) <= 1.0

    @property
    def follows_slip(self) -> bool:
        """Whether anything kept depends on a particle's velocity."""
        return self.held or not self.stokes

    @property
    def extrapolates(self) -> bool:
        """Whether that velocity is taken ahead of the present."""
        return self.follows_slip and self.case.time.drag_resolved

    @property
    def ahead_steps(self) -> float:
        """Steps from a refresh to the middle of what it is kept for."""
        return 0.5 * (self.case.time.refresh_every + 1)

    @property
    def ahead_s(self) -> float:
        """The same in seconds."""
        return self.ahead_steps * self.case.time.step_s

    @property
    def ahead(self) -> float:
        """The same in units of the interval."""
        return 0.5 * (1.0 + 1.0 / self.case.time.refresh_every)

    @property
    def pressure_per_r3(self) -> float:
        """Pressure force per cubed radius, Eq. 20, at its largest [N/m3]; 0 if not carried."""
        pressure = self.case.scene.pressure
        if pressure is None or not is_carried(self.case):
            return 0.0
        return pressure_force_n(1.0, pressure.gradient)

    @property
    def swing(self) -> str:
        """What of it there is at the middle of the coming interval; empty if it is constant."""
        return swing_formula(self.case, self.ahead_steps)

    def values(self) -> dict[str, object]:
        """For the fragments ``drag_kept``, ``drag_held`` and ``drag_implicit``."""
        moving = self._moving()
        in_motion = moving or drag_law.inside_velocity_m_s(self.case) != 0.0
        law: dict[str, object] = {
            "every": self.case.time.refresh_every,
            "now": 1.0 + self.ahead,
            "last": self.ahead,
            "coupling": self.case.scene.drag.carrier == "coupling",
            "follows_slip": self.follows_slip,
            "extrapolates": self.extrapolates,
            "stokes": self.stokes,
            "kept_factor": drag_law.drag_factor_formula(
                drag_law.reynolds_bound(self.case), "f_slip_re2"
            ),
            "moving": self._midway() if moving else "",
            "pressure_per_r3": self.pressure_per_r3,
            "swing": self.swing,
            "regions": self.specimen,
        }
        if self.held:
            return law | {"fluid_then": self._fluid_then(), "pressed": self._pressed()}
        return law | {
            "fluid_then": "f_uf[1]" if in_motion else "",
            "slip": "vx-f_uf[1]" if in_motion else "vx",
        }

    def refresh(self) -> Refresh:
        """The commands before the run, and those after every interval."""
        once, again = self._held() if self.held else self._implicit()
        if self.extrapolates:
            once.insert(0, _EARLIER)
        return Refresh(self.case.time.refresh_every, tuple(once), tuple(again))

    def _held(self) -> tuple[list[str], list[str]]:
        law = [_of_particles("slip_re2", "v_slip_re2"), _of_particles("coefficient", "v_kept_drag")]
        again = self._slip()
        again += [] if self.stokes else law
        again.append(_of_particles("dragforce", "v_kept_x v_kept_y v_kept_z"))
        return (law[1:] if self.stokes else []), again

    def _implicit(self) -> tuple[list[str], list[str]]:
        once: list[str] = []
        again: list[str] = []
        unsteady = self.specimen or self._accelerates()
        (again if unsteady else once).extend(self._fluid())
        (again if self.specimen else once).extend(self._pressure())
        if self.stokes:
            once.append(_of_particles("Ksl", "v_kept_drag"))
            return once, again
        law = [_of_particles("slip_re2", "v_slip_re2"), _of_particles("Ksl", "v_kept_drag")]
        return once, [*again, *self._slip(), *law]

    def _slip(self) -> list[str]:
        return [_SLIP, _EARLIER] if self.extrapolates else [_SLIP]

    def _fluid(self) -> list[str]:
        outside = "region outside" if self.specimen else "group particles"
        inside = drag_law.inside_velocity_m_s(self.case)
        commands = []
        if self._moving():
            commands.append(_set(outside, "uf", "$(v_fluid_velocity) 0.0 0.0"))
        elif inside:
            commands.append(_set(outside, "uf", "0.0 0.0 0.0"))
        if self.specimen and commands:
            commands.append(_set("region inside", "uf", f"{inside!r} 0.0 0.0"))
        return commands

    def _pressure(self) -> list[str]:
        if not self.pressure_per_r3:
            return []
        force = "v_pressure_x v_zero v_zero"
        if not self.specimen:
            return [_of_particles("dragforce", force)]
        nothing = _set("region outside", "dragforce", "0.0 0.0 0.0")
        return [nothing, _set("region inside", "dragforce", force)]

    def _moving(self) -> bool:
        return drag_law.outside_velocity_formula(self.case) != drag_law.AT_REST

    def _accelerates(self) -> bool:
        return drag_law.outside_acceleration_formula(self.case) != drag_law.AT_REST

    def _midway(self) -> str:
        """Fluid velocity outside at the middle of the coming interval, in the engine's words."""
        now = drag_law.outside_velocity_formula(self.case)
        change = drag_law.outside_acceleration_formula(self.case)
        return f"{now}+{change}*{self.ahead_s!r}" if self._accelerates() else now

    def _fluid_then(self) -> str:
        """Fluid velocity at the middle of the interval, where the particle then is."""
        outside = "v_fluid_velocity" if self._moving() else ""
        if not self.specimen:
            return outside
        inside = drag_law.inside_velocity_m_s(self.case)
        terms = [f"{outside}*({self._x_then()}<0.0)"] if outside else []
        terms += [f"{inside!r}*({self._x_then()}>=0.0)"] if inside else []
        return "+".join(terms)

    def _pressed(self) -> str:
        """Pressure force at the middle of the interval, where the particle then is."""
        if not self.pressure_per_r3:
            return ""
        force = "f_pressure*v_swing" if self.swing else "f_pressure"
        return f"{force}*({self._x_then()}>=0.0)" if self.specimen else force

    def _x_then(self) -> str:
        return f"x+{self.ahead_s!r}*vx"


def _of_particles(name: str, value: str) -> str:
    return _set("group particles", name, value)


def _set(whom: str, name: str, value: str) -> str:
    return f"set {whom} property/atom {name} {value}"


_EARLIER = _of_particles("earlier", "v_now_x v_now_y v_now_z")
_SLIP = _of_particles("slip", "v_slip_x v_slip_y v_slip_z")
