"""Predicted cost of a run: against the case with all its spheres placed."""

from __future__ import annotations

import numpy as np
import pytest
from small_scenes import COLLISION, GRAIN, INFILTRATION, changed, scene_of, shipped

from liggghts_driver.errors import SceneError
from liggghts_driver.explain import explain
from liggghts_driver.packing.radii import sample_radii
from liggghts_driver.scene.model import Particles
from liggghts_driver.sweeps.cost import expected_radii_m, plan_cost, predict_cost
from liggghts_driver.sweeps.plan import make_plan

#: Of thousands of radii cut at three deviations the smallest is known to 0.1 of a deviation, which
#: is 1/15 of the mean: 1 %. As much again for the largest grain, which a contact hardly feels.
MANY = 0.02
#: Of forty, the smallest scatters by 0.45 deviations from seed to seed, 3.5 % of it: three times.
FEW = 0.10


def compare(scene, tolerance: float) -> None:
    cost, facts = predict_cost(scene), explain(scene)
    size, wall = facts["size"], facts["predicted_wall_s"]
    assert cost.particles == size["particles"]
    assert cost.particle_steps == cost.particles * cost.steps
    assert cost.steps == pytest.approx(size["steps"], rel=tolerance)
    assert cost.core_s_dilute == pytest.approx(wall["dilute"], rel=tolerance)
    assert cost.core_s_packed == pytest.approx(wall["packed"], rel=tolerance)
    # Frames fall on samples, whose number does not hang on the step.
    assert cost.disk_bytes == pytest.approx(size["disk_mb"] * 1e6, rel=1e-12)


@pytest.mark.parametrize("name", ["infiltration_small", "infiltration", "infiltration_friction"])
def test_a_shipped_case_costs_what_its_own_spheres_say(name):
    compare(scene_of(shipped(name)), MANY)


@pytest.mark.parametrize("gradient", [1.0, 100.0, 10000.0])
def test_also_where_another_gradient_makes_other_steps(gradient):
    compare(scene_of(shipped("infiltration_small"), {"pressure.gradient": gradient}), MANY)


@pytest.mark.parametrize("name", ["two_spheres", "settling_sphere"])
def test_single_spheres_are_known_exactly(name):
    compare(scene_of(shipped(name)), 1e-12)


@pytest.mark.parametrize("seed", range(1, 6))
def test_a_handful_of_particles(seed):
    compare(scene_of(INFILTRATION, {"seed": seed, "pressure.gradient": 1000.0}), FEW)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_fewer_particles_than_typical_ones(count):
    box = {
        "spheres": [GRAIN],
        "grains": {"youngs_modulus": 1.0e6, "poissons_ratio": 0.25},
        "particles.radius_mean": 0.001,
        "particles.count": count,
        "fluid": {"density": 1000.0, "viscosity": 0.001, "velocity_outside": "constant"},
        "drag.scheme": "exact",
    }
    compare(scene_of(COLLISION, box), 1e-12)  # all radii are equal


def test_a_screened_effect_costs_nothing():
    tables = changed(shipped("infiltration_friction"), {"contact.friction": 1e-6})
    whole = predict_cost(scene_of(tables))
    screened = predict_cost(scene_of(tables, {"effects.screen": 0.01}))
    assert screened.core_s_packed < whole.core_s_packed
    compare(scene_of(tables, {"effects.screen": 0.01}), MANY)


def test_a_step_far_above_its_bound_is_refused_as_the_run_would():
    tables = shipped("infiltration")
    step = 1e-4
    bound = explain(scene_of(tables))["time_step_bounds"][0]["step_s"]
    assert bound / step < 1.05  # the case's own is near its bound, and passes
    predict_cost(scene_of(tables))
    with pytest.raises(SceneError, match=r"time\.step = 0\.00011 s: must be at most"):
        predict_cost(scene_of(tables, {"time.step": 1.1e-4}))


def test_a_step_just_above_the_expected_bound_is_left_to_the_run():
    """The spheres of some seed may allow it."""
    tables = changed(INFILTRATION, {"pressure.gradient": 1000.0})
    expected = 1.0 / predict_cost(scene_of(tables)).steps
    cost = predict_cost(scene_of(tables, {"time.step": 1.02 * expected}))
    assert cost.steps == pytest.approx(1.0 / (1.02 * expected), rel=0.01)  # whole steps a sample
    with pytest.raises(SceneError):
        predict_cost(scene_of(tables, {"time.step": 1.2 * expected}))


@pytest.mark.parametrize("count", [3, 10, 100, 3000])
def test_extremes_are_those_of_drawn_radii_on_average(count):
    radii = Particles(
        density=1.0, youngs_modulus=1.0, poissons_ratio=0.2, radius_mean=1.0, radius_deviation=0.1
    )
    rng = np.random.default_rng(1)
    drawn = sample_radii(1.0, 0.1, 400 * count, rng).reshape(400, count)
    smallest, mean, largest = expected_radii_m(radii, count)
    # Mean of 400 extremes that scatter by at most 0.75 deviations (of three): 0.04 deviations;
    # the formula's own error is 0.02. Two and a half times their sum.
    assert smallest == pytest.approx(drawn.min(axis=1).mean(), abs=0.015)
    assert largest == pytest.approx(drawn.max(axis=1).mean(), abs=0.015)
    assert (smallest + largest) / 2 == pytest.approx(mean)


def test_a_plan_costs_the_sum_of_its_runs_each_once(tmp_path):
    path = tmp_path / "sweep.toml"
    path.write_text(
        'scene = "infiltration_small"\nreplicates = 3\n[[axes]]\nkey = "time.duration"\n'
        "values = [10.0, 5.0, 10]\n"
    )
    total = plan_cost(make_plan(path))
    long = predict_cost(scene_of(shipped("infiltration_small"), {"time.duration": 10.0}))
    short = predict_cost(scene_of(shipped("infiltration_small"), {"time.duration": 5.0}))
    assert total.runs == 6  # nine points, the first and the last combination are one scene
    assert total.particle_steps == 3 * (long.particle_steps + short.particle_steps)
    assert total.core_s_packed == pytest.approx(3 * (long.core_s_packed + short.core_s_packed))
    assert total.disk_bytes == 3 * (long.disk_bytes + short.disk_bytes)
