"""The drag law of a case as formulas of the engine: drag factor, Reynolds bound, fluid velocity."""

from __future__ import annotations

from typing import TYPE_CHECKING

from liggghts_driver.physics.drag import BRANCHES, reynolds
from liggghts_driver.prediction import pore_velocity_m_s
from liggghts_driver.speeds import fluid_acceleration_m_s2

if TYPE_CHECKING:
    from liggghts_driver.case import Case

#: The speed bound is an estimate; branches of Eq. 18 up to this many times it are written, and the
#: verdict tells when a run went beyond them.
_MARGIN = 1.5
AT_REST = "0.0"


def reynolds_bound(case: Case) -> float:
    """The Reynolds number up to which this deck's law is complete: the end of a branch."""
    fluid = case.scene.fluid
    assert fluid is not None
    if not case.population.particles:
        return BRANCHES[0].up_to
    radius = float(case.population.particle_radii_m.max())
    speed = _MARGIN * (case.speed_bound_m_s + abs(inside_velocity_m_s(case)))
    bound = float(reynolds(fluid.density, fluid.viscosity, radius, speed))
    return next(branch.up_to for branch in BRANCHES if bound <= branch.up_to)


def drag_factor_formula(bound: float, re2: str) -> str:
    """f(Re) of Eq. 18 in the engine's words, as a function of the word for Re^2, up to a bound.

    Squared Reynolds numbers save a square root for every particle and step; a comparison is 1
    or 0 in the engine. Branches that the scene cannot reach are left out.
    """
    terms = []
    lower = 0.0
    for branch in BRANCHES:
        if lower >= bound:
            break
        conditions = [] if lower == 0.0 else [f"({re2}>{lower**2!r})"]
        conditions += [] if branch.up_to >= bound else [f"({re2}<={branch.up_to**2!r})"]
        value = [] if branch.factor == 1.0 else [repr(branch.factor)]
        value += [] if branch.power == 0.0 else [_power(re2, branch.power / 2)]
        terms.append("*".join([*conditions, *value]) or "1.0")
        lower = branch.up_to
    return "+".join(terms)


def _power(word: str, exponent: float) -> str:
    return f"sqrt({word})" if exponent == 0.5 else f"{word}^{exponent!r}"


def inside_velocity_m_s(case: Case) -> float:
    """Fluid velocity inside the specimen: zero, or the pore velocity of Darcy's law."""
    fluid = case.scene.fluid
    if fluid is None or fluid.velocity_inside == "still":
        return 0.0
    return pore_velocity_m_s(case.scene)


def outside_velocity_formula(case: Case) -> str:
    """Fluid velocity outside the specimen as a formula of the engine; ``AT_REST`` when zero."""
    fluid = case.scene.fluid
    assert fluid is not None
    if fluid.velocity_outside == "piston":
        return "v_piston_velocity"
    if fluid.velocity_outside == "accelerating":
        return f"{fluid_acceleration_m_s2(case.scene)!r}*v_time"
    return repr(fluid.velocity) if fluid.velocity_outside == "constant" else AT_REST


def outside_acceleration_formula(case: Case) -> str:
    """Rate of change of the fluid velocity outside, in the engine's words; ``AT_REST`` if none."""
    fluid = case.scene.fluid
    assert fluid is not None
    if fluid.velocity_outside == "piston":
        return "v_piston_acceleration"
    if fluid.velocity_outside == "accelerating":
        return repr(fluid_acceleration_m_s2(case.scene))
    return AT_REST


def slip_formula(case: Case) -> str:
    """The x velocity of a particle relative to the fluid at its place, in the engine's words."""
    outside, inside = outside_velocity_formula(case), inside_velocity_m_s(case)
    if case.scene.specimen is None:
        return "vx" if outside == AT_REST else f"vx-{outside}"
    terms = [] if outside == AT_REST else [f"-{outside}*(x<0.0)"]
    terms += [f"-{inside!r}*(x>=0.0)"] if inside else []
    return "vx" + "".join(terms)
