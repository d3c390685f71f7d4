from __future__ import annotations

import dataclasses
import json
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from liggghts_driver.darcy import (
    DarcyInputs,
    calibrate_phi,
    estimate,
    gradient_for,
    reynolds_number,
)

# A handful of products and quotients: some 10 roundings of 1.1e-16 each.
ROUNDING = 2e-15


def near(expected, rel=ROUNDING):
    # Without abs=0 every difference below 1e-12 would pass, and most values here are that small.
    return pytest.approx(expected, rel=rel, abs=0)


PAPER = DarcyInputs(
    fluid_density_kg_m3=2e3,
    particle_density_kg_m3=7e3,
    fluid_viscosity_pa_s=1e-3,
    particle_fraction=0.15,
    particle_radius_m=1.5e-3,
    permeability_1_m2=1e-9,
    permeability_2_m2=1e-6,
    solid_fraction=0.55,
    phi=0.5,
    area_m2=0.01,
    length_m=0.1,
)
GRADIENTS = np.array([1.0, 2.0, 5.0, 10.0, 20.0])


def with_(**changes):
    return dataclasses.replace(PAPER, **changes)


@pytest.mark.parametrize(
    ("name", "value", "half_digit"),
    [
        ("effective_density_kg_m3", 2750, 0.5),
        ("effective_viscosity_pa_s", 1.4412e-3, 0.5e-7),
        ("permeability_lower_m2", 3.441e-9, 0.5e-12),
        ("permeability_upper_m2", 3.537e-7, 0.5e-10),
        ("effective_permeability_m2", 1.786e-7, 0.5e-10),
        ("gradient_to_flux_pa_s_m2", 8.07e3, 5),
        ("particle_flow_rate_m3_s", 1.86e-6, 0.5e-8),
        ("pore_velocity_m_s", 2.75e-3, 0.5e-5),
        ("pressure_drop_pa", 1.0, 0.05),
    ],
)
def test_the_papers_equations_at_10_pa_m(name, value, half_digit):
    # Its equations recomputed by hand; half of the last digit kept. The paper's own P*, Q and
    # velocity are 3 % higher, see the next test.
    assert getattr(estimate(PAPER, 10.0), name) == pytest.approx(value, abs=half_digit)


def test_the_papers_printed_flow_and_velocity_follow_from_its_printed_permeability():
    answer = estimate(PAPER, GRADIENTS)
    printed_over_computed = 1.84e-7 / answer.effective_permeability_m2
    flow = answer.particle_flow_rate_m3_s * printed_over_computed
    velocity = answer.pore_velocity_m_s * printed_over_computed
    # Table 1; P* has three printed digits, half of the last is 0.3 %, and so have Q and velocity.
    np.testing.assert_allclose(flow, [1.92e-7, 3.84e-7, 9.62e-7, 1.92e-6, 3.84e-6], rtol=0.006)
    np.testing.assert_allclose(velocity, [2.84e-4, 5.68e-4, 1.42e-3, 2.84e-3, 5.68e-3], rtol=0.006)


def test_reynolds_leaves_the_law_between_10_and_20_pa_m_as_in_the_paper():
    answer = estimate(PAPER, GRADIENTS)
    # 2 * 2000 * 0.0015 / 0.001 = 6000 s/m times q = 1.239e-3 m/s, four digits kept.
    assert answer.reynolds[3] == pytest.approx(7.434, abs=0.5e-3)
    assert answer.valid.tolist() == [True, True, True, True, False]
    (sentence,) = answer.warnings
    assert "reynolds = 14.9 at 20 Pa/m exceeds 10" in sentence


def test_the_pore_velocity_would_put_10_pa_m_outside():
    speed = estimate(PAPER, 10.0).pore_velocity_m_s
    reynolds = reynolds_number(
        speed_m_s=speed,
        particle_radius_m=PAPER.particle_radius_m,
        fluid_density_kg_m3=PAPER.fluid_density_kg_m3,
        fluid_viscosity_pa_s=PAPER.fluid_viscosity_pa_s,
    )
    # 7.434 / 0.45, four digits kept.
    assert reynolds == pytest.approx(16.52, abs=0.5e-2)


def test_every_gradient_outside_is_named():
    answer = estimate(PAPER, np.array([20.0, 10.0, -30.0]))
    assert answer.valid.tolist() == [False, True, False]
    (sentence,) = answer.warnings
    assert "14.9 at 20 Pa/m, 22.3 at -30 Pa/m" in sentence
    assert "10 Pa/m," not in sentence


def test_a_dense_suspension_is_outside_at_every_gradient():
    answer = estimate(with_(particle_fraction=0.16), np.array([1.0, 2.0]))
    assert answer.valid.tolist() == [False, False]
    (sentence,) = answer.warnings
    assert "particle_fraction = 0.16 exceeds 0.15" in sentence


def test_both_bounds_missed_give_two_sentences():
    answer = estimate(with_(particle_fraction=0.2), 40.0)
    assert answer.valid is False
    assert [sentence.split(" =")[0] for sentence in answer.warnings] == [
        "particle_fraction",
        "reynolds",
    ]


def test_inside_there_is_no_warning_but_isotropy_stays_assumed():
    answer = estimate(PAPER, 10.0)
    assert answer.valid is True
    assert answer.warnings == ()
    assert any("isotropic" in sentence for sentence in answer.assumptions)


# What each answer is proportional to: (field, input) -> power.
POWERS = {
    ("darcy_flux_m_s", "area_m2"): 0,
    ("flow_rate_m3_s", "area_m2"): 1,
    ("particle_flow_rate_m3_s", "area_m2"): 1,
    ("pore_velocity_m_s", "area_m2"): 0,
    ("pressure_drop_pa", "length_m"): 1,
    ("flow_rate_m3_s", "length_m"): 0,
    ("effective_viscosity_pa_s", "fluid_viscosity_pa_s"): 1,
    ("flow_rate_m3_s", "fluid_viscosity_pa_s"): -1,
    ("reynolds", "fluid_viscosity_pa_s"): -2,
    ("reynolds", "particle_radius_m"): 1,
    ("reynolds", "fluid_density_kg_m3"): 1,
    ("reynolds", "particle_density_kg_m3"): 0,
    ("flow_rate_m3_s", "particle_radius_m"): 0,
}


@pytest.mark.parametrize(("field", "changed"), list(POWERS))
def test_answers_scale_as_their_dimensions_say(field, changed):
    factor = 3.0
    before = getattr(estimate(PAPER, 10.0), field)
    larger = with_(**{changed: factor * getattr(PAPER, changed)})
    after = getattr(estimate(larger, 10.0), field)
    assert after / before == near(factor ** POWERS[field, changed])


def test_answers_scale_with_both_permeabilities_together():
    wider = with_(permeability_1_m2=3e-9, permeability_2_m2=3e-6)
    before, after = estimate(PAPER, 10.0), estimate(wider, 10.0)
    assert after.flow_rate_m3_s / before.flow_rate_m3_s == near(3)
    assert after.gradient_to_flux_pa_s_m2 / before.gradient_to_flux_pa_s_m2 == near(1 / 3)


def test_the_answers_agree_with_each_other():
    answer = estimate(PAPER, GRADIENTS)
    for one, other in (
        (answer.darcy_flux_m_s * answer.gradient_to_flux_pa_s_m2, GRADIENTS),
        (answer.pore_velocity_m_s * 0.45, answer.darcy_flux_m_s),
        (answer.particle_flow_rate_m3_s / 0.15, answer.flow_rate_m3_s),
        (answer.flow_rate_m3_s / 0.01, answer.darcy_flux_m_s),
    ):
        np.testing.assert_allclose(one, other, rtol=ROUNDING)


def test_phi_goes_from_the_lower_to_the_upper_bound():
    for phi, bound in ((0.0, "permeability_lower_m2"), (1.0, "permeability_upper_m2")):
        answer = estimate(with_(phi=phi), 10.0)
        assert answer.effective_permeability_m2 == getattr(answer, bound)


def test_a_pure_fluid_in_a_uniform_solid_is_plain_darcy():
    plain = with_(particle_fraction=0.0, solid_fraction=0.0, permeability_1_m2=0.0)
    answer = estimate(plain, 10.0)
    # q = 1e-6 / 1e-3 * 10.
    assert answer.darcy_flux_m_s == near(1e-2)
    assert answer.pore_velocity_m_s == answer.darcy_flux_m_s
    assert answer.particle_flow_rate_m3_s == 0
    assert answer.effective_density_kg_m3 == 2e3


def test_equal_permeabilities_leave_phi_without_effect():
    flows = [
        estimate(with_(permeability_1_m2=1e-6, phi=phi), 10.0).flow_rate_m3_s for phi in (0, 0.3, 1)
    ]
    np.testing.assert_allclose(flows, flows[0], rtol=ROUNDING)


def test_an_array_gives_what_its_elements_give_in_its_shape():
    gradients = np.array([[1.0, 2.0, 5.0], [10.0, 20.0, 0.0]])
    together = estimate(PAPER, gradients)
    for place in np.ndindex(gradients.shape):
        alone = estimate(PAPER, float(gradients[place]))
        for field in dataclasses.fields(alone):
            value = getattr(together, field.name)
            if isinstance(value, np.ndarray):
                assert value.shape == gradients.shape
                # The same operations in the same order: equal to the last bit.
                assert value[place] == getattr(alone, field.name), field.name
            elif field.name != "warnings":
                assert value == getattr(alone, field.name), field.name


def test_a_later_change_of_the_gradients_does_not_reach_the_answer():
    gradients = GRADIENTS.copy()
    answer = estimate(PAPER, gradients)
    gradients[:] = 0
    np.testing.assert_array_equal(answer.pressure_gradient_pa_m, GRADIENTS)


@settings(deadline=None)
@given(
    st.floats(1e-9, 1e-3),
    st.floats(0, 0.6),
    st.floats(0, 0.9),
    st.floats(0, 1),
    st.floats(1e-12, 1e-6),
)
def test_the_gradient_for_a_flow_rate_gives_that_flow_rate(flow, v_p, v1, phi, permeability_1):
    inputs = with_(
        particle_fraction=v_p, solid_fraction=v1, phi=phi, permeability_1_m2=permeability_1
    )
    answer = gradient_for(inputs, flow_rate_m3_s=flow)
    assert answer.flow_rate_m3_s == near(flow)
    again = estimate(inputs, answer.pressure_gradient_pa_m)
    assert again.as_dict() == answer.as_dict()


def test_the_gradients_for_flow_rates_have_their_shape():
    forwards = estimate(PAPER, GRADIENTS)
    backwards = gradient_for(PAPER, flow_rate_m3_s=forwards.flow_rate_m3_s)
    np.testing.assert_allclose(backwards.pressure_gradient_pa_m, GRADIENTS, rtol=ROUNDING)


def test_phi_is_found_again_from_an_estimated_flow():
    answer = estimate(with_(phi=0.3), 10.0)
    phi = calibrate_phi(
        flow_rate_m3_s=answer.flow_rate_m3_s,
        pressure_gradient_pa_m=10.0,
        area_m2=PAPER.area_m2,
        viscosity_pa_s=answer.effective_viscosity_pa_s,
        permeability_lower_m2=answer.permeability_lower_m2,
        permeability_upper_m2=answer.permeability_upper_m2,
    )
    # Rounding alone: the bounds are a factor of 100 apart.
    assert phi == pytest.approx(0.3, abs=1e-14)


@pytest.mark.parametrize("gradient", [10.0, GRADIENTS])
def test_the_dictionary_is_plain_json(gradient):
    answer = estimate(PAPER, gradient)
    plain = answer.as_dict()
    assert list(plain) == [field.name for field in dataclasses.fields(answer)]
    assert json.loads(json.dumps(plain, allow_nan=False)) == plain
    np.testing.assert_array_equal(plain["flow_rate_m3_s"], answer.flow_rate_m3_s)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"fluid_density_kg_m3": 0.0}, "fluid_density_kg_m3 = 0.0: must be > 0"),
        ({"particle_density_kg_m3": -1.0}, "particle_density_kg_m3 = -1.0: must be > 0"),
        ({"fluid_viscosity_pa_s": 0.0}, "fluid_viscosity_pa_s = 0.0: must be > 0"),
        ({"particle_fraction": 1.0}, r"particle_fraction = 1.0: must be in \[0, 1\)"),
        ({"particle_fraction": -0.1}, r"particle_fraction = -0.1: must be in \[0, 1\)"),
        ({"particle_radius_m": 0.0}, "particle_radius_m = 0.0: must be > 0"),
        ({"permeability_1_m2": -1e-9}, "permeability_1_m2 = -1e-09: must be >= 0"),
        ({"permeability_2_m2": np.inf}, "permeability_2_m2 = inf: must be > 0 and finite"),
        ({"permeability_2_m2": 1e-10}, "permeability_2_m2 = 1e-10: must be >= permeability_1_m2"),
        ({"solid_fraction": 1.0}, r"solid_fraction = 1.0: must be in \[0, 1\)"),
        ({"phi": 1.1}, r"phi = 1.1: must be in \[0, 1\]"),
        ({"area_m2": np.nan}, "area_m2 = nan: must be > 0"),
        ({"length_m": 0.0}, "length_m = 0.0: must be > 0"),
    ],
)
def test_inputs_outside_the_physical_domain_are_refused(changes, named):
    with pytest.raises(ValueError, match=named):
        with_(**changes)


def test_all_faults_of_the_inputs_stand_in_one_message():
    with pytest.raises(ValueError, match=r"fluid_viscosity_pa_s = -1.*phi = 2.*area_m2 = 0"):
        with_(fluid_viscosity_pa_s=-1, phi=2, area_m2=0)


def test_a_solid_that_lets_nothing_through_is_refused():
    with pytest.raises(ValueError, match=r"phi = 0 with permeability_1_m2 = 0 .*must be > 0"):
        estimate(with_(phi=0, permeability_1_m2=0), 10.0)


@pytest.mark.parametrize("value", [np.nan, np.inf, np.array([1.0, np.nan])])
def test_gradients_and_flow_rates_are_finite(value):
    with pytest.raises(ValueError, match=r"pressure_gradient_pa_m = .*must be finite"):
        estimate(PAPER, value)
    with pytest.raises(ValueError, match=r"flow_rate_m3_s = .*must be finite"):
        gradient_for(PAPER, flow_rate_m3_s=value)


def test_the_estimator_needs_numpy_and_the_standard_library_only():
    # In a fresh interpreter; modules that its start-up or NumPy bring along are not counted.
    script = (
        "import sys, numpy; before = set(sys.modules); import liggghts_driver.darcy;"
        "print(*sorted(set(sys.modules) - before)); print(*sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60
    )
    brought, loaded = (line.split() for line in done.stdout.splitlines())
    foreign = {
        name
        for name in brought
        if name.split(".")[0] not in sys.stdlib_module_names | {"numpy"}
        and name != "liggghts_driver"
        and not name.startswith("liggghts_driver.darcy")
    }
    assert foreign == set()
    assert "liggghts_driver.darcy.estimate" in brought
    assert {"scipy", "pandas", "matplotlib", "pydantic"}.isdisjoint(loaded)
