"""Hertz contact with Tsuji damping: the closed forms that the engine is held to.

Source: the paper's Eq. 21 (after Johnson 1985) and, for the damping, the exact solution of the
damped Hertz collision (Antypov & Elliott 2011), whose restitution does not depend on the speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

#: Half the Beta function B(2/5, 1/2), times 4/5: the elastic Hertz contact lasts
#: 2.9432 x (largest overlap) / (impact speed).
_DURATION_PER_OVERLAP = 2.943275
#: The factor printed in Eq. 21. It is (15/16)^(2/5) x 2.9432, rounded.
_EQ21_FACTOR = 2.87


@dataclass(frozen=True)
class Body:
    """One partner of a contact.

    A wall has ``radius_m = inf``; a wall or a fixed grain has ``mass_kg = inf``.
    """

    radius_m: float
    mass_kg: float
    youngs_modulus_pa: float
    poissons_ratio: float


def effective_mass_kg(a: Body, b: Body) -> float:
    """Effective mass m* = 1 / (1/m_a + 1/m_b) [kg]; infinite masses are allowed."""
    return 1.0 / (1.0 / a.mass_kg + 1.0 / b.mass_kg)


def effective_radius_m(a: Body, b: Body) -> float:
    """Effective radius r* = 1 / (1/r_a + 1/r_b) [m]; a flat wall has an infinite radius."""
    return 1.0 / (1.0 / a.radius_m + 1.0 / b.radius_m)


def effective_modulus_pa(a: Body, b: Body) -> float:
    """Effective modulus E* = 1 / ((1-nu_a^2)/E_a + (1-nu_b^2)/E_b) [Pa]."""
    compliance = sum((1.0 - p.poissons_ratio**2) / p.youngs_modulus_pa for p in (a, b))
    return 1.0 / compliance


def contact_duration_s(a: Body, b: Body, relative_speed_m_s: float) -> float:
    """Duration of an elastic Hertz contact, Eq. 21 [s].

    Parameters
    ----------
    a, b
        The partners.
    relative_speed_m_s
        Approach speed along the line of centres when they first touch.

    Raises
    ------
    ValueError
        If the speed is not positive: a contact without approach lasts for ever.
    """
    if not relative_speed_m_s > 0:
        raise ValueError(f"relative_speed_m_s = {relative_speed_m_s}: must be above 0")
    inertia = effective_mass_kg(a, b) ** 2
    stiffness = effective_radius_m(a, b) * effective_modulus_pa(a, b) ** 2
    return _EQ21_FACTOR * float((inertia / (stiffness * relative_speed_m_s)) ** 0.2)


def largest_overlap_m(a: Body, b: Body, relative_speed_m_s: float) -> float:
    """Largest overlap of an elastic Hertz collision, from its energy balance [m].

    m* v^2 / 2 = (8/15) E* sqrt(r*) delta^(5/2).
    """
    energy = effective_mass_kg(a, b) * relative_speed_m_s**2 / 2.0
    coefficient = 8.0 / 15.0 * effective_modulus_pa(a, b) * math.sqrt(effective_radius_m(a, b))
    return float((energy / coefficient) ** 0.4)


def pressed_overlap_m(a: Body, b: Body, force_n: float) -> float:
    """Overlap of a Hertz contact at rest under a force [m]: F = (4/3) E* sqrt(r*) delta^(3/2)."""
    stiffness = 4.0 / 3.0 * effective_modulus_pa(a, b) * math.sqrt(effective_radius_m(a, b))
    return float((force_n / stiffness) ** (2.0 / 3.0))


def pressed_half_period_s(a: Body, b: Body, force_n: float) -> float:
    """Half a period of small oscillations about a contact under a force [s].

    Half of 2 pi sqrt(m* / S) with the tangent stiffness S = dF / d delta = (3/2) F / delta. It is
    to a pressed contact what its duration is to a collision: a collision whose largest force is F
    lasts 1.28 times as long.

    Raises
    ------
    ValueError
        If the force is not positive: a contact without a force has no stiffness.
    """
    if not force_n > 0:
        raise ValueError(f"force_n = {force_n}: must be above 0")
    stiffness = 1.5 * force_n / pressed_overlap_m(a, b, force_n)
    return math.pi * math.sqrt(effective_mass_kg(a, b) / stiffness)


def pull_off_force_n(a: Body, b: Body, energy_density_j_m3: float) -> float:
    """Force that parts two bodies held together by a cohesion energy density [N].

    Spheres that overlap by d << r* cut each other in a circle of area 2 pi r* d. The attraction
    C 2 pi r* d and Hertz's repulsion leave the force (repulsion positive)

        F(d) = (4/3) E* sqrt(r*) d^(3/2) - 2 pi C r* d,

    least where 2 E* sqrt(r* d) = 2 pi C r*, at d = r* (pi C / E*)^2. There the repulsion is two
    thirds of the attraction, and F = -(2/3) pi C r* d = -(2/3) pi^3 C^3 r*^2 / E*^2. The circle's
    exact area makes the force smaller by about (3/8) d / r* of itself for equal spheres and by
    (3/2) d / r* for a sphere on a plane.

    Parameters
    ----------
    a, b
        The partners.
    energy_density_j_m3
        C, the attraction per area of the circle.
    """
    radius, modulus = effective_radius_m(a, b), effective_modulus_pa(a, b)
    return 2.0 / 3.0 * (math.pi * energy_density_j_m3) ** 3 * radius**2 / modulus**2


def elastic_duration_s(a: Body, b: Body, relative_speed_m_s: float) -> float:
    """The same duration as Eq. 21 without its rounded factor [s]."""
    return _DURATION_PER_OVERLAP * largest_overlap_m(a, b, relative_speed_m_s) / relative_speed_m_s


def restitution_from_damping_ratio(damping_ratio: float) -> float:
    """Coefficient of restitution that belongs to the paper's damping ratio xi_n.

    The paper damps with 2 xi_n sqrt(m* S_n), S_n the contact's tangent stiffness; the engine with
    2 sqrt(5/6) beta sqrt(m* S_n), beta = -ln e / sqrt(ln^2 e + pi^2). Equal forces mean
    beta = xi_n sqrt(6/5), which is inverted here for e.

    Raises
    ------
    ValueError
        If the ratio is outside [0, sqrt(5/6)): beyond it the spheres never separate.
    """
    beta = damping_ratio * math.sqrt(6.0 / 5.0)
    if not 0.0 <= beta < 1.0:
        raise ValueError(f"damping_ratio = {damping_ratio}: must be in [0, {math.sqrt(5 / 6):.4f})")
    return math.exp(-math.pi * beta / math.sqrt(1.0 - beta**2))


def damping_ratio_from_restitution(restitution: float) -> float:
    """The paper's damping ratio xi_n for a coefficient of restitution in (0, 1]."""
    if not 0.0 < restitution <= 1.0:
        raise ValueError(f"restitution = {restitution}: must be in (0, 1]")
    log = math.log(restitution)
    return -log / math.sqrt(log**2 + math.pi**2) * math.sqrt(5.0 / 6.0)
