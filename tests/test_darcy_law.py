from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from liggghts_driver.darcy import (
    calibrate_phi,
    combine_bounds,
    darcy_flux,
    flow_rate,
    gradient_for_flow_rate,
    gradient_to_flux,
    inlet_pressure,
    particle_flow_rate,
    pore_velocity,
    reynolds_number,
)

# A handful of products and quotients: some 10 roundings of 1.1e-16 each.
ROUNDING = 2e-15


def near(expected, rel=ROUNDING):
    # Without abs=0 every difference below 1e-12 would pass, and most values here are that small.
    return pytest.approx(expected, rel=rel, abs=0)


positive = st.floats(1e-9, 1e9)

MEASURED = {
    "pressure_gradient_pa_m": 10.0,
    "area_m2": 0.01,
    "viscosity_pa_s": 1.4412e-3,
    "permeability_lower_m2": 3.441e-9,
    "permeability_upper_m2": 3.537e-7,
}


# Small whole numbers keep the expected values exact and their units plain to see.
def test_flux_is_permeability_times_gradient_over_viscosity():
    assert darcy_flux(pressure_gradient_pa_m=3.0, permeability_m2=2.0, viscosity_pa_s=4.0) == 1.5


def test_flux_follows_the_sign_of_the_drop():
    flux = darcy_flux(
        pressure_gradient_pa_m=np.array([-3.0, 0.0, 3.0]), permeability_m2=2.0, viscosity_pa_s=4.0
    )
    np.testing.assert_array_equal(flux, [-1.5, 0.0, 1.5])


def test_flow_rates_and_velocity_from_the_flux():
    assert flow_rate(flux_m_s=1.5, area_m2=4.0) == 6.0
    assert particle_flow_rate(flow_rate_m3_s=6.0, particle_fraction=0.25) == 1.5
    assert pore_velocity(flux_m_s=1.5, pore_fraction=0.5) == 3.0


def test_ratio_of_gradient_to_flux_is_positive():
    assert gradient_to_flux(permeability_m2=2.0, viscosity_pa_s=4.0) == 2.0


def test_ratio_of_the_paper_from_its_own_rounded_numbers():
    # One unit of its last digit: mu* = 0.00144 and P* = 1.84e-7 give 7826, printed as 7.82e3.
    ratio = gradient_to_flux(permeability_m2=1.84e-7, viscosity_pa_s=0.00144)
    assert ratio == pytest.approx(7.82e3, abs=10)


@settings(deadline=None)
@given(positive, positive, positive, positive)
def test_gradient_for_a_flow_rate_gives_that_flow_rate(wanted, area, permeability, viscosity):
    medium = {"permeability_m2": permeability, "viscosity_pa_s": viscosity}
    gradient = gradient_for_flow_rate(flow_rate_m3_s=wanted, area_m2=area, **medium)
    flux = darcy_flux(pressure_gradient_pa_m=gradient, **medium)
    assert flow_rate(flux_m_s=flux, area_m2=area) == near(wanted)


def test_inlet_pressure_is_the_outlets_plus_the_drop():
    # Gradient 4 / 2 * 6 / 4 = 3 Pa/m over 5 m.
    pressure = inlet_pressure(
        flow_rate_m3_s=6.0,
        outlet_pressure_pa=100.0,
        length_m=5.0,
        area_m2=4.0,
        permeability_m2=2.0,
        viscosity_pa_s=4.0,
    )
    assert pressure == 115.0


def test_arrays_give_what_their_elements_give():
    flows = np.array([1.0, 3.0, 7.0])
    medium = {"area_m2": 4.0, "permeability_m2": 3.0, "viscosity_pa_s": 7.0}
    one_by_one = [gradient_for_flow_rate(flow_rate_m3_s=float(q), **medium) for q in flows]
    together = gradient_for_flow_rate(flow_rate_m3_s=flows, **medium)
    # The same operations in the same order: equal to the last bit.
    np.testing.assert_array_equal(together, one_by_one)


def flow_at(phi, lower, upper, gradient=10.0):
    permeability = combine_bounds(lower, upper, phi)
    flux = darcy_flux(
        pressure_gradient_pa_m=gradient, permeability_m2=permeability, viscosity_pa_s=1.4412e-3
    )
    return flow_rate(flux_m_s=flux, area_m2=0.01)


@settings(deadline=None)
@given(st.floats(0, 1), st.floats(0, 0.99), st.sampled_from([-20.0, 0.1, 10.0]))
def test_calibrated_phi_is_the_one_that_made_the_flow(phi, lower_share, gradient):
    upper = 3.537e-7
    lower = lower_share * upper
    bounds = {"permeability_lower_m2": lower, "permeability_upper_m2": upper}
    calibrated = calibrate_phi(
        flow_rate_m3_s=flow_at(phi, lower, upper, gradient),
        **{**MEASURED, **bounds, "pressure_gradient_pa_m": gradient},
    )
    # Rounding of 1e-15 divided by the distance of the bounds, at least 0.01 of the upper one, is
    # 1e-13; the slack that admits a flow exactly on a bound is clipped away.
    assert calibrated == pytest.approx(phi, abs=5e-13)


def test_phi_is_calibrated_for_arrays():
    lower, upper = MEASURED["permeability_lower_m2"], MEASURED["permeability_upper_m2"]
    phi = np.array([0.0, 0.3, 1.0])
    calibrated = calibrate_phi(flow_rate_m3_s=flow_at(phi, lower, upper), **MEASURED)
    # As above, with bounds further apart.
    np.testing.assert_allclose(calibrated, phi, atol=1e-14)


def test_rounding_does_not_push_phi_out_of_its_range():
    lower, upper = MEASURED["permeability_lower_m2"], MEASURED["permeability_upper_m2"]
    # A few units in the last place beyond either bound, as another order of operations may give.
    flows = flow_at(np.array([0.0, 1.0]), lower, upper) * np.array([1 - 1e-15, 1 + 1e-15])
    np.testing.assert_array_equal(calibrate_phi(flow_rate_m3_s=flows, **MEASURED), [0.0, 1.0])


@pytest.mark.parametrize("gradient", [10.0, -10.0])
@pytest.mark.parametrize("beyond", [-0.01, 1.01])
def test_a_flow_beyond_the_bounds_is_refused_with_the_range(beyond, gradient):
    lower, upper = MEASURED["permeability_lower_m2"], MEASURED["permeability_upper_m2"]
    slowest, fastest = flow_at(np.array([0, 1]), lower, upper, gradient)
    flow = slowest + beyond * (fastest - slowest)
    with pytest.raises(ValueError, match="out of reach") as caught:
        calibrate_phi(flow_rate_m3_s=flow, **{**MEASURED, "pressure_gradient_pa_m": gradient})
    message = str(caught.value)
    for number in (flow, gradient):
        assert str(number) in message
    # The message's own numbers, read back, are the reachable range.
    printed = [float(part.split()[0]) for part in message.split(" gives ")[1:]]
    assert printed == near([slowest, fastest])


@pytest.mark.parametrize("flow", [0.0, 1e-6, np.nan])
def test_a_flow_without_a_gradient_is_refused(flow):
    with pytest.raises(ValueError, match=r"pressure_gradient_pa_m = 0.0"):
        calibrate_phi(flow_rate_m3_s=flow, **{**MEASURED, "pressure_gradient_pa_m": 0.0})


def test_a_flow_that_is_not_a_number_is_refused():
    with pytest.raises(ValueError, match="flow_rate_m3_s = nan"):
        calibrate_phi(flow_rate_m3_s=np.nan, **MEASURED)


@pytest.mark.parametrize("lower", [3.537e-7, 3.537e-7 * (1 - 1e-15), 4e-7])
def test_bounds_that_leave_phi_no_effect_are_refused(lower):
    with pytest.raises(ValueError, match=r"permeability_lower_m2 = .*must be below"):
        calibrate_phi(flow_rate_m3_s=1e-6, **{**MEASURED, "permeability_lower_m2": lower})


def test_reynolds_number_is_that_of_eq_19_for_either_direction():
    carried = {
        "particle_radius_m": 0.25,
        "fluid_density_kg_m3": 2.0,
        "fluid_viscosity_pa_s": 0.5,
    }
    speeds = np.array([-3.0, 0.0, 3.0])
    np.testing.assert_array_equal(reynolds_number(speed_m_s=speeds, **carried), [6.0, 0.0, 6.0])
