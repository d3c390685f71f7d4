"""How deep collisions can be that no frame shows: against closed forms, and what is said of it."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from small_scenes import COLLISION, GRAIN, INFILTRATION, case_of

from liggghts_driver.physics.contact import Body, largest_overlap_m
from liggghts_driver.results.collisions import collision_overlap_over_radius, unseen_collisions

RADIUS, MODULUS = 0.0015, 1.0e7
MASS = 7000.0 * 4.0 / 3.0 * math.pi * RADIUS**3
SPHERE = Body(RADIUS, MASS, MODULUS, 0.25)
#: One expression in two orders of its factors.
ROUNDING = {"rel": 1e-12, "abs": 0.0}


def run_at(speed: float, **columns) -> pd.DataFrame:
    """The series of a run in which the largest speed is that."""
    time = np.linspace(0.0, 0.1, 21)
    named = {"largest_speed_m_s": speed * np.sin(20 * time), "kinetic_energy_j": 0.0 * time}
    return pd.DataFrame({"time_s": time, **named, **columns})


def test_two_alike_meet_head_on():
    found = collision_overlap_over_radius(case_of(COLLISION), 0.3)
    assert found == pytest.approx(largest_overlap_m(SPHERE, SPHERE, 0.6) / RADIUS, **ROUNDING)


def test_it_is_the_same_for_small_and_large_spheres():
    """Mass goes with the volume, and so does what the energy of a contact is proportional to."""
    large = [{**sphere, "radius": 2.0 * RADIUS} for sphere in COLLISION["spheres"]]
    for sphere, side in zip(large, (-1.0, 1.0), strict=True):
        sphere["position"] = [side * 0.004, 0.0, 0.0]
    other = collision_overlap_over_radius(case_of(COLLISION, {"spheres": large}), 0.3)
    assert other == pytest.approx(
        collision_overlap_over_radius(case_of(COLLISION), 0.3), **ROUNDING
    )


def test_no_pair_of_sizes_is_deeper():
    case = case_of(INFILTRATION, {"specimen": {**INFILTRATION["specimen"], "solid_fraction": 0.05}})
    radii = case.population.particle_radii_m
    bodies = [Body(r, 7000.0 * 4.0 / 3.0 * math.pi * r**3, MODULUS, 0.25) for r in radii]
    deepest = max(
        largest_overlap_m(a, b, 0.2) / min(a.radius_m, b.radius_m) for a in bodies for b in bodies
    )
    # Grains, softer and fixed, are deeper still.
    assert collision_overlap_over_radius(case, 0.1) > deepest


def test_a_soft_grain_and_a_wall():
    grains = {"youngs_modulus": 1.0e6, "poissons_ratio": 0.25}
    one = {"spheres": [COLLISION["spheres"][0], GRAIN], "grains": grains}
    grain = Body(GRAIN["radius"], math.inf, 1.0e6, 0.25)
    assert collision_overlap_over_radius(case_of(COLLISION, one), 0.3) == pytest.approx(
        largest_overlap_m(SPHERE, grain, 0.3) / RADIUS, **ROUNDING
    )
    alone = {"spheres": COLLISION["spheres"][:1], "box.walls": ["z-"]}
    wall = Body(math.inf, math.inf, MODULUS, 0.25)
    assert collision_overlap_over_radius(case_of(COLLISION, alone), 0.3) == pytest.approx(
        largest_overlap_m(SPHERE, wall, 0.3) / RADIUS, **ROUNDING
    )


def test_a_piston_comes_to_meet_them():
    piston = {"piston": {"acceleration": 1.0, "mass": 1.0}, "spheres": COLLISION["spheres"][:1]}
    case = case_of(COLLISION, piston)
    assert collision_overlap_over_radius(case, 0.2, 0.1) == pytest.approx(
        collision_overlap_over_radius(case, 0.3), **ROUNDING
    )


def test_what_meets_nothing_has_no_overlap():
    assert collision_overlap_over_radius(case_of(COLLISION, {"spheres": [
        COLLISION["spheres"][0]]}), 100.0) == 0.0  # fmt: skip


def test_what_attracts_is_not_bounded():
    cohesive = case_of(COLLISION, {"contact.cohesion_energy_density": 100.0})
    assert math.isnan(collision_overlap_over_radius(cohesive, 0.3))


class TestWords:
    def test_where_frames_show_less_than_there_can_have_been(self):
        case = case_of(COLLISION)
        series = run_at(0.1)
        said = unseen_collisions(case, series, 0.004)
        assert "the frames show overlaps of up to 0.004 of the smaller radius" in said
        assert "largest speed, 0.1 m/s, overlaps by up to 0.029" in said

    def test_nothing_where_all_is_within_bounds(self):
        assert unseen_collisions(case_of(COLLISION), run_at(0.02), 0.004) is None

    def test_nothing_where_the_verdict_speaks(self):
        case, series = case_of(COLLISION), run_at(0.1)
        assert unseen_collisions(case, series, 0.02) is None
        assert unseen_collisions(case, series, math.nan) is None

    def test_where_spheres_may_have_gone_through_each_other(self):
        """No reason against an answer: parallel flights at any speed meet nobody."""
        # Half a radius deep, (15/16 m* (2v)^2 / (E* sqrt(r*)))^(2/5), at v = 3.484 m/s.
        case = case_of(COLLISION, {"time.step": 1e-6, "time.duration": 1e-3})
        assert "hold nothing apart" in unseen_collisions(case, run_at(3.5), 0.0)
        assert "hold nothing apart" not in unseen_collisions(case, run_at(3.45), 0.0)
