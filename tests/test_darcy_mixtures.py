from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from liggghts_driver.darcy import (
    bulk_modulus_bounds,
    combine_bounds,
    conductivity_bounds,
    effective_density,
    einstein_viscosity,
    shear_modulus_bounds,
    viscosity_lower_bound,
)

# A handful of products and quotients of positive numbers: some 10 roundings of 1.1e-16 each.
ROUNDING = 2e-15


def near(expected, rel=ROUNDING):
    # Without abs=0 every difference below 1e-12 would pass, and most values here are that small.
    return pytest.approx(expected, rel=rel, abs=0)


positive = st.floats(1e-9, 1e9)
contrast = st.floats(1.01, 1e4)
inner_fraction = st.floats(0.01, 0.99)
unit_interval = st.floats(0, 1)


# Eqs. 4, 5 and 10 as the paper prints them, which is not how the package computes them.
def printed_lower(p1, p2, v2, term):
    return p1 + v2 / (1 / (p2 - p1) + (1 - v2) * term)


def printed_upper(p1, p2, v2, term):
    return p2 + (1 - v2) / (1 / (p1 - p2) + v2 * term)


def bulk_term(bulk, shear):
    return 3 / (3 * bulk + 4 * shear)


def shear_term(bulk, shear):
    return 6 * (bulk + 2 * shear) / (5 * shear * (3 * bulk + 4 * shear))


def test_density_of_the_paper():
    assert effective_density(2e3, 7e3, 0.15) == near(2750)


def test_density_of_each_phase_alone():
    assert effective_density(2e3, 7e3, 0.0) == 2e3
    assert effective_density(2e3, 7e3, 1.0) == 7e3


def test_viscosity_of_the_paper():
    # Half of the last of the five digits that the recomputed value is given with.
    assert viscosity_lower_bound(1e-3, 0.15) == pytest.approx(1.4412e-3, abs=0.5e-7)


def test_viscosity_is_einsteins_when_dilute_to_second_order():
    v_p = np.array([0.02, 0.01, 0.005, 0.0025])
    difference = viscosity_lower_bound(1.0, v_p) - einstein_viscosity(1.0, v_p)
    order = np.log2(difference[:-1] / difference[1:])
    # The difference is 2.5 v^2 / (1 - v): the order is 2 plus about v / (2 ln 2) = 0.72 v.
    assert np.all(np.abs(order - 2) < v_p[:-1])
    assert difference[-1] / v_p[-1] ** 2 == pytest.approx(2.5, rel=2 * v_p[-1])


def test_einsteins_viscosity():
    assert einstein_viscosity(1e-3, 0.01) == near(1.025e-3)


@pytest.mark.parametrize("fraction", [-0.01, 1.0, np.nan, np.array([0.1, 1.0])])
def test_viscosity_refuses_a_fraction_outside_its_range(fraction):
    with pytest.raises(ValueError, match=r"particle_fraction = .*must be in \[0, 1\)"):
        viscosity_lower_bound(1e-3, fraction)


def test_rigid_particles_in_an_incompressible_matrix_turn_eq_5_into_eq_6():
    v_p, viscosity = 0.15, 1e-3
    stiffness = 10.0 ** np.arange(3, 8)
    lower, _ = shear_modulus_bounds(
        viscosity * stiffness, viscosity, viscosity * stiffness, viscosity * stiffness, v_p
    )
    error = np.abs(lower / viscosity_lower_bound(viscosity, v_p) - 1)
    # First order in 1 / stiffness; the terms left out are 1e-3 of it at the coarsest, with some
    # factor, and rounding is 1e-16 / 1e-7 of it at the finest.
    assert error[:-1] / error[1:] == pytest.approx(10, rel=1e-2)
    assert error[-1] < 1e-6


def test_nearly_rigid_phase_neither_overflows_nor_cancels():
    lower, upper = shear_modulus_bounds(1e150, 1.0, 1e300, 1e300, 0.15)
    assert lower == near(viscosity_lower_bound(1.0, 0.15))
    assert np.isfinite(upper)


@settings(deadline=None)
@given(positive, positive, contrast, contrast, inner_fraction)
def test_moduli_agree_with_the_printed_equations(bulk_1, shear_1, more_bulk, more_shear, v2):
    bulk_2, shear_2 = bulk_1 * more_bulk, shear_1 * more_shear
    moduli = (bulk_1, shear_1, bulk_2, shear_2, v2)
    for p1, p2, bounds, term in (
        (bulk_1, bulk_2, bulk_modulus_bounds(*moduli), bulk_term),
        (shear_1, shear_2, shear_modulus_bounds(*moduli), shear_term),
    ):
        # The printed upper bound subtracts from p2 and may lose a factor contrast / fraction =
        # 1e6 of the 1e-16, and some more in its nested sum.
        expected = (
            printed_lower(p1, p2, v2, term(bulk_1, shear_1)),
            printed_upper(p1, p2, v2, term(bulk_2, shear_2)),
        )
        assert bounds == near(expected, rel=1e-8)


@settings(deadline=None)
@given(positive, contrast, inner_fraction)
def test_conductivity_agrees_with_the_printed_equations(p1, more, v2):
    p2 = p1 * more
    expected = (
        printed_lower(p1, p2, v2, 1 / (3 * p1)),
        printed_upper(p1, p2, v2, 1 / (3 * p2)),
    )
    # As above: the printed upper bound cancels.
    assert conductivity_bounds(p1, p2, v2) == near(expected, rel=1e-8)


def test_permeability_of_the_paper():
    lower, upper = conductivity_bounds(1e-9, 1e-6, 0.45)
    # Half of the last digit that the recomputed values are given with.
    assert lower == pytest.approx(3.441e-9, abs=0.5e-12)
    assert upper == pytest.approx(3.537e-7, abs=0.5e-10)
    assert combine_bounds(lower, upper, 0.5) == pytest.approx(1.786e-7, abs=0.5e-10)


@settings(deadline=None)
@given(positive, positive, st.floats(1, 1e12), st.floats(1, 1e12), unit_interval)
def test_bounds_lie_in_order_between_harmonic_and_arithmetic_mean(k1, g1, more_k, more_g, v2):
    k2, g2 = k1 * more_k, g1 * more_g
    for p1, p2, (lower, upper) in (
        (k1, k2, bulk_modulus_bounds(k1, g1, k2, g2, v2)),
        (g1, g2, shear_modulus_bounds(k1, g1, k2, g2, v2)),
        (k1, k2, conductivity_bounds(k1, k2, v2)),
    ):
        harmonic = 1 / ((1 - v2) / p1 + v2 / p2)
        arithmetic = (1 - v2) * p1 + v2 * p2
        ascending = np.array([harmonic, lower, upper, arithmetic])
        assert np.all(ascending[:-1] <= ascending[1:] * (1 + ROUNDING))


@settings(deadline=None)
@given(positive, positive, st.floats(1, 1e12))
def test_bounds_coincide_with_a_phase_that_is_alone(k1, g1, more):
    k2, g2 = k1 * more, g1 * more
    for fraction_2, bulk, shear in ((0.0, k1, g1), (1.0, k2, g2)):
        moduli = (k1, g1, k2, g2, fraction_2)
        assert bulk_modulus_bounds(*moduli) == near((bulk, bulk))
        assert shear_modulus_bounds(*moduli) == near((shear, shear))
        assert conductivity_bounds(k1, k2, fraction_2) == near((bulk, bulk))


@settings(deadline=None)
@given(positive, positive, unit_interval)
def test_bounds_coincide_for_equal_phases(bulk, shear, v2):
    moduli = (bulk, shear, bulk, shear, v2)
    assert bulk_modulus_bounds(*moduli) == near((bulk, bulk))
    assert shear_modulus_bounds(*moduli) == near((shear, shear))
    assert conductivity_bounds(bulk, bulk, v2) == near((bulk, bulk))


@settings(deadline=None)
@given(positive, positive, st.floats(1, 1e6), unit_interval)
def test_bulk_bounds_coincide_for_equal_shear_moduli(bulk, shear, more, v2):
    # Hill's exact result: with one shear modulus throughout, the bulk modulus is known.
    lower, upper = bulk_modulus_bounds(bulk, shear, bulk * more, shear, v2)
    assert lower == near(upper)


def test_an_impermeable_phase_blocks_the_lower_bound_only():
    v2 = np.array([0.0, 0.3, 0.45, 1.0])
    lower, upper = conductivity_bounds(0.0, 1e-6, v2)
    # Phase 2 alone (the last one) is as permeable as phase 2; for the upper bound Eq. 10 reduces
    # to 2 v2 / (3 - v2).
    np.testing.assert_array_equal(lower, [0.0, 0.0, 0.0, 1e-6])
    np.testing.assert_allclose(upper, 1e-6 * 2 * v2 / (3 - v2), rtol=ROUNDING)


def test_upper_bound_keeps_its_digits_when_the_phases_are_far_apart():
    # As printed, Eq. 10 subtracts 1e-6 from 1e-6 here and cannot find 1e-20.
    _, upper = conductivity_bounds(1e-20, 1e-6, 0.0)
    assert upper == near(1e-20)


@pytest.mark.parametrize(
    ("phases", "named"),
    [
        ((2e-6, 1e-6, 0.5), "phase_2 = 1e-06: must be >= phase_1 = 2e-06"),
        ((-1e-9, 1e-6, 0.5), "phase_1 = -1e-09: must be >= 0"),
        ((0.0, 0.0, 0.5), "phase_2 = 0.0: must be > 0"),
        ((1e-9, np.inf, 0.5), "phase_2 = inf: must be > 0 and finite"),
        ((np.nan, 1e-6, 0.5), "phase_1 = nan"),
        ((1e-9, 1e-6, 1.5), r"fraction_2 = 1.5: must be in \[0, 1\]"),
        ((1e-9, 1e-6, -0.5), r"fraction_2 = -0.5: must be in \[0, 1\]"),
        ((1e-9, np.array([1e-6, 1e-10]), 0.5), "phase_2 = .*must be >= phase_1"),
    ],
)
def test_conductivity_refuses_what_cannot_be(phases, named):
    with pytest.raises(ValueError, match=named):
        conductivity_bounds(*phases)


@pytest.mark.parametrize("bounds", [bulk_modulus_bounds, shear_modulus_bounds])
@pytest.mark.parametrize(
    ("moduli", "named"),
    [
        ((0.0, 0.0, 2.0, 1.0), "bulk_1 = 0.0: must be > 0"),
        ((2.0, 1.0, 1.0, 1.0), "bulk_2 = 1.0: must be >= bulk_1 = 2.0"),
        ((2.0, 1.0, 3.0, 0.5), "shear_2 = 0.5: must be >= shear_1 = 1.0"),
        ((2.0, -1.0, 3.0, 0.5), "shear_1 = -1.0: must be >= 0"),
    ],
)
def test_moduli_refuse_what_cannot_be(bounds, moduli, named):
    with pytest.raises(ValueError, match=named):
        bounds(*moduli, 0.5)


def test_phi_weighs_the_upper_bound():
    np.testing.assert_array_equal(combine_bounds(2.0, 6.0, np.array([0, 0.25, 1])), [2.0, 3.0, 6.0])


@pytest.mark.parametrize("phi", [-0.1, 1.1, np.nan])
def test_phi_outside_its_range_is_refused(phi):
    with pytest.raises(ValueError, match=r"phi = .*must be in \[0, 1\]"):
        combine_bounds(2.0, 6.0, phi)


def test_arrays_give_what_their_elements_give():
    p1 = np.array([[0.0], [1.0], [2.0]])
    v2 = np.array([0.0, 0.4, 0.7, 1.0])
    for fixed_moduli in (
        lambda p, v: conductivity_bounds(p, 3.0, v),
        lambda p, v: bulk_modulus_bounds(p + 1, p, 3.0, 2.0, v),
        lambda p, v: shear_modulus_bounds(p + 1, p, 3.0, 2.0, v),
    ):
        one_by_one = [[fixed_moduli(float(p), float(v)) for v in v2] for p in p1[:, 0]]
        together = np.stack(fixed_moduli(p1, v2), axis=-1)
        # The same operations in the same order: equal to the last bit.
        np.testing.assert_array_equal(together, one_by_one)
