"""The piston: Newton's law for a rigid plate, from the engine's own servo wall."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar

from liggghts_driver.effects import costs
from liggghts_driver.effects.base import Column, Effect, Slot, Weight
from liggghts_driver.effects.scales import scales_of
from liggghts_driver.errors import SceneError

if TYPE_CHECKING:
    from liggghts_driver.case import Case
    from liggghts_driver.scene.model import Scene

#: The mesh reaches this share of the width beyond the side walls, so that its edge touches nobody.
_OVERHANG = 0.05
#: Room between the speed that can be reached and the servo's limit, where it ceases to be Newton's.
_SPEED_MARGIN = 10.0
#: A step so short that nothing moves in it, to the last bit.
NO_TIME_S = 1e-20


class Piston(Effect):
    """A rigid piston of mass M, pushed by F = M a and by the particles and grains it touches.

    The engine's servo sets v = vel_max ki / |F| x integral of (F + contact force) dt, which is
    Newton's law when ki = F / (M vel_max) and kp = kd = 0, as long as vel_max is not reached.
    """

    name: ClassVar[str] = "piston"
    title: ClassVar[str] = "piston"
    slot: ClassVar[Slot] = "boundaries"
    order: ClassVar[int] = 2

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when the scene has a piston."""
        if scene.piston is None:
            return False, "the scene has no [piston]"
        return True, f"pushed with {scene.piston.acceleration:g} m/s2"

    def weigh(self, case: Case) -> Weight:
        """Force of the piston over that of the pressure on all particles, or over their weight."""
        assert case.scene.piston is not None
        scales = scales_of(case)
        force = case.piston_mass_kg * case.scene.piston.acceleration
        each = max(scales.pressure_n, scales.weight_n, scales.inertia_n)
        others = each * case.population.particles
        meaning = "piston's force over the largest other on all particles"
        return Weight("piston number", meaning, force / others if others else math.inf)

    def cost(self, case: Case) -> float:  # noqa: ARG002
        """A moving wall with its servo."""
        return costs.PISTON

    def values(self, case: Case) -> dict[str, object]:
        """Force, gain, limit, place; and whether the fluid moves with it."""
        piston, fluid = case.scene.piston, case.scene.fluid
        assert piston is not None
        follows = fluid is not None and fluid.velocity_outside == "piston"
        force = case.piston_mass_kg * piston.acceleration
        limit = speed_limit_m_s(case)
        then = case.checkpoint
        velocity = then.piston_velocity_m_s if then else 0.0
        return {
            "mass": case.piston_mass_kg,
            "acceleration": piston.acceleration,
            "force": force,
            "gain": force / (case.piston_mass_kg * limit),
            "limit": limit,
            "step": case.time.step_s,
            "taken_up": then.step if then else 0,
            "velocity_then": velocity,
            # The servo's integral of all forces is M v; one step that lasts NO_TIME_S adds it up.
            "integral": case.piston_mass_kg * velocity / NO_TIME_S,
            "x": case.layout.low[0],
            "y": (case.layout.low[1] + case.layout.high[1]) / 2,
            "z": (case.layout.low[2] + case.layout.high[2]) / 2,
            "type": case.type_of("walls"),
            "recent": case.time.refresh_every if follows and case.time.keeps_drag else 0,
        }

    def columns(self, case: Case) -> tuple[Column, ...]:  # noqa: ARG002
        """Place of the piston and the force of all contacts on it."""
        return (Column("piston_x_m", "f_piston[7]"), Column("piston_force_n", "f_piston[1]"))


def speed_limit_m_s(case: Case) -> float:
    """The servo's vel_max: far above what the piston can reach, below what the skin allows.

    Raises
    ------
    SceneError
        If the engine's rule vel_max < skin / (2 dt) leaves no room; the bounds on the step keep it.
    """
    assert case.scene.piston is not None
    reachable = case.speed_bound_m_s
    rule = 0.99 * case.skin_m / (2.0 * case.time.step_s)
    if rule < 2.0 * reachable:
        raise SceneError(
            f"time.step = {case.time.step_s:g} s: the engine limits the piston to "
            f"{rule:.3g} m/s (skin / (2 step)), it may reach {reachable:.3g} m/s; use a step of "
            f"at most {0.99 * case.skin_m / (4 * reachable):.3g} s"
        )
    return min(_SPEED_MARGIN * reachable, rule)


def piston_stl(case: Case) -> str:
    """The piston's surface as a file of two triangles, facing +x."""
    _, y_low, z_low = case.layout.low
    x = case.layout.low[0]
    _, y_high, z_high = case.layout.high
    over_y, over_z = _OVERHANG * (y_high - y_low), _OVERHANG * (z_high - z_low)
    a, b = (x, y_low - over_y, z_low - over_z), (x, y_high + over_y, z_low - over_z)
    c, d = (x, y_high + over_y, z_high + over_z), (x, y_low - over_y, z_high + over_z)
    facets = "".join(_facet(corners) for corners in ((a, b, c), (a, c, d)))
    return f"solid piston\n{facets}endsolid piston\n"


def _facet(corners: tuple[tuple[float, ...], ...]) -> str:
    lines = "".join(f"      vertex {x!r} {y!r} {z!r}\n" for x, y, z in corners)
    return f"  facet normal 1 0 0\n    outer loop\n{lines}    endloop\n  endfacet\n"
