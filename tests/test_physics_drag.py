"""The drag law against Eqs. 17-19 as the paper prints them, and free flight against its balance."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from liggghts_driver.physics.drag import (
    drag_coefficient_n_s_m,
    drag_factor,
    free_flight_speed_m_s,
    reynolds,
)
from liggghts_driver.physics.spheres import sphere_volume_m3

RHO, MU = 2000.0, 0.001
BOUNDS = (1.0, 400.0, 3.0e5, 2.0e6)


def printed_coefficient(re: float) -> float:
    """C_D of Eq. 18, line by line."""
    if re <= 1:
        return 24 / re
    if re <= 400:
        return 24 * re**-0.646
    if re <= 3e5:
        return 0.5
    if re <= 2e6:
        return 0.000366 * re**0.4275
    return 0.18


def printed_force(radius: float, speed: float, rho: float = RHO, mu: float = MU) -> float:
    """Magnitude of Eq. 17 with Eqs. 18 and 19."""
    re = 2 * rho * radius * speed / mu
    return 0.5 * rho * printed_coefficient(re) * math.pi * radius**2 * speed**2


@given(st.floats(1e-9, 1e8))
@settings(deadline=None)
def test_drag_factor_is_eq_18_over_stokes(re):
    assert float(drag_factor(re)) == pytest.approx(re * printed_coefficient(re) / 24, rel=1e-12)


@pytest.mark.parametrize("bound", BOUNDS)
def test_each_line_of_eq_18_ends_with_its_bound(bound):
    for re in (bound, np.nextafter(bound, np.inf)):
        assert float(drag_factor(re)) == pytest.approx(re * printed_coefficient(re) / 24, rel=1e-12)


def test_eq_18_jumps_by_as_much_as_printed():
    """The lines meet at Re = 1 and nearly at 400; at 3e5 the drag crisis takes 84 % away."""
    jumps = [float(drag_factor(np.nextafter(b, np.inf)) / drag_factor(b)) - 1 for b in BOUNDS]
    # Expected values from the printed coefficients, by hand; two digits each.
    assert jumps == pytest.approx([0.0, -0.0009, -0.839, -0.004], abs=0.0006)


def test_a_sphere_at_rest_has_stokes_drag():
    assert float(drag_factor(0.0)) == 1.0
    expected = 6 * math.pi * MU * 0.0015
    assert float(drag_coefficient_n_s_m(RHO, MU, 0.0015, 0.0)) == pytest.approx(expected, rel=1e-14)


@given(st.floats(1e-5, 0.1), st.floats(1e-8, 100.0))
@settings(deadline=None)
def test_force_is_eq_17(radius, speed):
    coefficient = float(drag_coefficient_n_s_m(RHO, MU, radius, speed))
    assert coefficient * speed == pytest.approx(printed_force(radius, speed), rel=1e-12)


def test_arrays_go_in_and_come_out():
    radii = np.array([0.001, 0.002])
    speeds = np.array([[0.0], [-0.1], [0.1]])
    assert reynolds(RHO, MU, radii, speeds).shape == (3, 2)
    coefficients = drag_coefficient_n_s_m(RHO, MU, radii, speeds)
    assert coefficients.shape == (3, 2)
    # The direction of the flow does not matter.
    assert np.array_equal(coefficients[1], coefficients[2])
    assert float(reynolds(RHO, MU, 0.0015, -0.01)) == pytest.approx(60.0, rel=1e-14)


@pytest.mark.parametrize(
    ("gradient", "speed"), [(1, 5.06e-4), (2, 8.44e-4), (5, 1.66e-3), (10, 2.77e-3), (20, 4.63e-3)]
)
def test_free_flight_of_the_papers_particle(gradient, speed):
    force = 2 * math.pi * 0.0015**3 * gradient
    # physics.md prints three digits.
    assert free_flight_speed_m_s(RHO, MU, 0.0015, force) == pytest.approx(speed, rel=0.002)


@given(st.floats(1e-4, 0.02), st.floats(-12, 4))
@settings(deadline=None)
def test_free_flight_is_the_slowest_balance_of_eqs_17_to_20(radius, exponent):
    force = 10.0**exponent
    speed = free_flight_speed_m_s(RHO, MU, radius, force)
    assert printed_force(radius, speed) == pytest.approx(force, rel=1e-9)
    # Drag falls where Eq. 18 jumps, so a force may balance twice; a sphere from rest meets the
    # slower balance first. Below it drag must be the weaker of the two everywhere.
    below = speed * np.geomspace(1e-6, 1 - 1e-6, 200)
    assert all(printed_force(radius, slower) < force for slower in below)


def test_free_flight_against_a_root_finder():
    force = 2 * math.pi * 0.0015**3 * 10
    root = brentq(lambda v: printed_force(0.0015, v) - force, 1e-9, 1.0, xtol=1e-15, rtol=1e-13)
    assert free_flight_speed_m_s(RHO, MU, 0.0015, force) == pytest.approx(root, rel=1e-10)


def test_free_flight_goes_with_a_power_of_the_gradient():
    """Re f(Re) ~ v^1.354 for 1 < Re < 400, so v ~ (grad p)^(1/1.354), the 0.74th power."""
    speeds = [free_flight_speed_m_s(RHO, MU, 0.0015, 2 * math.pi * 0.0015**3 * g) for g in (2, 20)]
    assert math.log10(speeds[1] / speeds[0]) == pytest.approx(1 / 1.354, rel=1e-9)


def test_free_flight_without_or_against_a_force():
    assert free_flight_speed_m_s(RHO, MU, 0.0015, 0.0) == 0.0
    assert free_flight_speed_m_s(RHO, MU, 0.0015, -1e-6) == free_flight_speed_m_s(
        RHO, MU, 0.0015, 1e-6
    )


def test_volume_of_a_sphere():
    assert sphere_volume_m3(0.0015) == pytest.approx(math.pi / 6 * 0.003**3, rel=1e-14)
