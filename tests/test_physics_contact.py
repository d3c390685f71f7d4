"""The closed forms of the Hertz contact against Eq. 21 as printed and against its own ODE."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

from liggghts_driver.physics.contact import (
    Body,
    contact_duration_s,
    damping_ratio_from_restitution,
    effective_mass_kg,
    effective_modulus_pa,
    effective_radius_m,
    elastic_duration_s,
    largest_overlap_m,
    pressed_half_period_s,
    pressed_overlap_m,
    pull_off_force_n,
    restitution_from_damping_ratio,
)

MASS = 7000.0 * 4.0 / 3.0 * math.pi * 0.0015**3
PARTICLE = Body(0.0015, MASS, 1.0e7, 0.25)
GRAIN = Body(0.010, math.inf, 1.0e6, 0.25)
WALL = Body(math.inf, math.inf, 1.0e7, 0.25)
PARTNERS = pytest.mark.parametrize("other", [PARTICLE, GRAIN, WALL], ids=["pair", "grain", "wall"])


def collide(a: Body, b: Body, speed: float, damping_ratio: float = 0.0):
    """Integrate m d'' = -(4/3) E sqrt(r) d^1.5 - 2 xi sqrt(m S) d' until the bodies part.

    S = 2 E sqrt(r d) is the slope of the elastic force. Returns duration, largest overlap and
    parting speed. Time and overlap are scaled so that the equation is of order one.
    """
    mass, radius, modulus = (f(a, b) for f in (effective_mass_kg, effective_radius_m, e_star))
    overlap = (mass * speed**2 / (modulus * math.sqrt(radius))) ** 0.4
    time = overlap / speed
    stiff = 4.0 / 3.0 * modulus * math.sqrt(radius) * overlap**1.5 * time / (mass * speed)

    def rates(_: float, state):
        d = max(state[0], 0.0)
        damping = 2.0 * damping_ratio * math.sqrt(1.5 * stiff * math.sqrt(d))
        return [state[1], -stiff * d**1.5 - damping * state[1]]

    def parted(_: float, state):
        return state[0]

    def turned(_: float, state):
        return state[1]

    parted.terminal, parted.direction = True, -1
    done = solve_ivp(rates, (0, 30), [0, 1], events=[parted, turned], rtol=1e-10, atol=1e-12)
    (end,), (turn, *_) = done.t_events[0], done.y_events[1]
    return end * time, turn[0] * overlap, -done.y_events[0][0][1] * speed


def e_star(a: Body, b: Body) -> float:
    return 1.0 / (
        (1 - a.poissons_ratio**2) / a.youngs_modulus_pa
        + (1 - b.poissons_ratio**2) / b.youngs_modulus_pa
    )


def test_effective_values_by_hand():
    other = Body(0.003, 2 * MASS, 2.0e7, 0.5)
    # Rounding errors of a handful of operations are below 1e-14.
    assert effective_mass_kg(PARTICLE, other) == pytest.approx(MASS * 2 / 3, rel=1e-14)
    assert effective_radius_m(PARTICLE, other) == pytest.approx(0.001, rel=1e-14)
    expected = 1e7 * 2e7 / (2e7 * (1 - 0.0625) + 1e7 * 0.75)
    assert effective_modulus_pa(PARTICLE, other) == pytest.approx(expected, rel=1e-14)


def test_infinite_partners():
    assert effective_mass_kg(PARTICLE, WALL) == MASS
    assert effective_radius_m(PARTICLE, WALL) == 0.0015
    assert effective_mass_kg(PARTICLE, GRAIN) == MASS


@PARTNERS
def test_duration_is_eq_21_as_printed(other):
    m = MASS / 2 if other is PARTICLE else MASS
    r = {"pair": 0.00075, "grain": 0.0015 * 0.010 / 0.0115, "wall": 0.0015}[
        {PARTICLE: "pair", GRAIN: "grain", WALL: "wall"}[other]
    ]
    printed = 2.87 * (m**2 / (r * e_star(PARTICLE, other) ** 2 * 0.01)) ** (1 / 5)
    assert contact_duration_s(PARTICLE, other, 0.01) == pytest.approx(printed, rel=1e-12)


def test_the_papers_step_is_just_inside_a_tenth_of_the_contact():
    # physics.md: 1.2e-3 s at 1 cm/s, printed with two digits.
    assert contact_duration_s(PARTICLE, PARTICLE, 0.01) == pytest.approx(1.2e-3, rel=0.05)
    assert contact_duration_s(PARTICLE, PARTICLE, 0.01) > 10 * 1.0e-4


@PARTNERS
@pytest.mark.parametrize("speed", [1e-4, 0.01, 1.0])
def test_elastic_contact_against_its_ode(other, speed):
    duration, overlap, parting = collide(PARTICLE, other, speed)
    # The constant 2.943275 has seven digits; the integration is held to 1e-10.
    assert elastic_duration_s(PARTICLE, other, speed) == pytest.approx(duration, rel=1e-6)
    assert largest_overlap_m(PARTICLE, other, speed) == pytest.approx(overlap, rel=1e-7)
    assert parting == pytest.approx(speed, rel=1e-7)
    # Eq. 21 prints 2.87 for 2.8683: three digits.
    assert contact_duration_s(PARTICLE, other, speed) == pytest.approx(duration, rel=0.005 / 2.87)


@pytest.mark.parametrize("speed", [0.0, -1.0, math.nan])
def test_a_contact_needs_an_approach(speed):
    with pytest.raises(ValueError, match="relative_speed_m_s"):
        contact_duration_s(PARTICLE, PARTICLE, speed)


@pytest.mark.parametrize("damping_ratio", [0.0, 0.02, 0.1, 0.3, 0.6])
@pytest.mark.parametrize("speed", [1e-3, 0.5])
def test_restitution_against_the_damped_ode(damping_ratio, speed):
    *_, parting = collide(PARTICLE, PARTICLE, speed, damping_ratio)
    # The end of the contact, where the force has an infinite slope, costs the integration accuracy.
    expected = pytest.approx(parting / speed, rel=1e-5)
    assert restitution_from_damping_ratio(damping_ratio) == expected


def test_the_papers_damping_ratio():
    # physics.md: xi_n = 0.1 is e = 0.707, three digits.
    assert restitution_from_damping_ratio(0.1) == pytest.approx(0.707, abs=0.0005)


@given(st.floats(0.0, 0.9))
@settings(deadline=None)
def test_damping_force_is_the_engines(damping_ratio):
    """Paper: 2 xi sqrt(m S); engine: 2 sqrt(5/6) |beta(e)| sqrt(m S). Equal for every xi."""
    log = math.log(restitution_from_damping_ratio(damping_ratio))
    beta = abs(log) / math.hypot(log, math.pi)
    # Near xi = 0.91 the restitution is all but zero and its logarithm steep: a few digits are lost.
    assert math.sqrt(5 / 6) * beta == pytest.approx(damping_ratio, rel=1e-9, abs=1e-15)


@given(st.floats(1e-6, 1.0))
@settings(deadline=None)
def test_restitution_and_damping_ratio_are_inverse(restitution):
    ratio = damping_ratio_from_restitution(restitution)
    assert restitution_from_damping_ratio(ratio) == pytest.approx(restitution, rel=1e-9)


@pytest.mark.parametrize("ratio", [-1e-9, math.sqrt(5 / 6), 1.0, math.nan])
def test_damping_ratios_that_never_part_are_refused(ratio):
    with pytest.raises(ValueError, match="damping_ratio"):
        restitution_from_damping_ratio(ratio)


@pytest.mark.parametrize("restitution", [0.0, -0.5, 1.0001, math.nan])
def test_restitutions_outside_their_range_are_refused(restitution):
    with pytest.raises(ValueError, match="restitution"):
        damping_ratio_from_restitution(restitution)


def circle_area(a: Body, b: Body, overlap: float) -> float:
    """Area of the circle in which two spheres, or a sphere and a plane, cut each other.

    By Heron's formula the height of the triangle of radii and distance, or by Pythagoras.
    """
    if math.isinf(b.radius_m):
        return math.pi * (a.radius_m**2 - (a.radius_m - overlap) ** 2)
    apart = a.radius_m + b.radius_m - overlap
    s = (a.radius_m + b.radius_m + apart) / 2.0
    triangle = math.sqrt(s * (s - a.radius_m) * (s - b.radius_m) * (s - apart))
    return math.pi * (2.0 * triangle / apart) ** 2


@PARTNERS
@pytest.mark.parametrize("ratio", [1e-3, 5e-3, 2e-2])
def test_pull_off_is_the_least_force_of_hertz_and_the_circle(other, ratio):
    """Brute force: the least of repulsion less attraction, the circle's area taken exactly."""
    density = ratio * e_star(PARTICLE, other)
    radius = effective_radius_m(PARTICLE, other)
    least = radius * (math.pi * ratio) ** 2

    def force(overlap):
        hertz = 4.0 / 3.0 * e_star(PARTICLE, other) * math.sqrt(radius * overlap) * overlap
        return hertz - density * circle_area(PARTICLE, other, overlap)

    found = minimize_scalar(force, bounds=(0.1 * least, 10.0 * least), method="bounded",
                            options={"xatol": 1e-9 * least})  # fmt: skip
    # The closed form is the leading order: the area's next term is at most (3/2) d / r* of the
    # force, to first order, and 1e-8 is the rounding of the triangle's area at these overlaps.
    expected = pull_off_force_n(PARTICLE, other, density)
    assert -found.fun == pytest.approx(expected, rel=1.6 * least / radius + 1e-8)
    assert found.x == pytest.approx(least, rel=4.0 * least / radius + 1e-4)


def test_without_cohesion_nothing_holds():
    assert pull_off_force_n(PARTICLE, WALL, 0.0) == 0.0


def test_equal_spheres_and_a_plane_differ_as_the_docstring_says():
    """The next term of the circle's area: (3/8) d / r* for equal spheres, 3/2 on a plane."""
    ratio = 5e-3
    for other, coefficient in ((PARTICLE, 3.0 / 8.0), (WALL, 3.0 / 2.0)):
        radius = effective_radius_m(PARTICLE, other)
        least = radius * (math.pi * ratio) ** 2
        hertz = 4.0 / 3.0 * math.sqrt(radius) * least**1.5
        # The minimum is flat: at the leading order's place the force is right to first order.
        force = ratio * circle_area(PARTICLE, other, least) - hertz
        expected = pull_off_force_n(PARTICLE, other, ratio * e_star(PARTICLE, other))
        missing = 1.0 - force * e_star(PARTICLE, other) / expected
        # The second order is d / r* = 2.5e-4 of the first.
        assert missing == pytest.approx(coefficient * least / radius, rel=1e-3)


def test_a_pressed_contact_swings_as_fast_as_a_collision_of_that_force_is_short():
    """Their ratio is a number.

    Hertz's collision lasts 2.9433 d / v and its largest force is F(d), whose spring's half period
    is pi sqrt(2 d m* / (3 F)), and m* v^2 / 2 = (2/5) F d.
    """
    a, b = PARTICLE, GRAIN
    overlap = largest_overlap_m(a, b, 0.3)
    modulus, radius = effective_modulus_pa(a, b), effective_radius_m(a, b)
    force = 4 / 3 * modulus * math.sqrt(radius) * overlap**1.5
    assert pressed_overlap_m(a, b, force) == pytest.approx(overlap, rel=1e-12)
    ratio = elastic_duration_s(a, b, 0.3) / pressed_half_period_s(a, b, force)
    expected = 2.943275 / math.sqrt(0.8) / (math.pi * math.sqrt(2 / 3))
    assert ratio == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("force", [0.0, -1.0, math.nan])
def test_a_contact_without_a_force_does_not_swing(force):
    with pytest.raises(ValueError, match="force_n"):
        pressed_half_period_s(PARTICLE, PARTICLE, force)
