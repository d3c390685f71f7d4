"""Where a scene puts walls, suspension and sections, and how many particles it holds."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import trapezoid
from small_scenes import COLLISION, GONE, INFILTRATION, MATERIAL, scene_of, shipped

from liggghts_driver.scene.layout import (
    layout,
    mean_particle_volume_m3,
    particle_count,
    particle_fraction,
)
from liggghts_driver.scene.schema import scene_schema

SIDES = ("y-", "y+", "z-", "z+")


def test_a_closed_specimen_with_a_piston():
    place = layout(scene_of(INFILTRATION, {"specimen.height": 0.03}))
    assert place.low == (-0.03, -0.01, -0.015)
    assert place.high == (0.02, 0.01, 0.015)
    assert place.fill_low == place.low
    assert place.fill_high == (0.0, 0.01, 0.015)
    assert place.sections == {"entrance": 0.0, "middle": 0.01}
    # Where the piston stands there is no wall.
    assert set(place.walls) == {"x+", *SIDES}
    assert place.area_m2 == pytest.approx(0.02 * 0.03, rel=1e-14)


def test_without_a_piston_the_reservoir_is_closed():
    changes = {"piston": GONE, "fluid.velocity_outside": "still"}
    assert set(layout(scene_of(INFILTRATION, changes)).walls) == {"x-", "x+", *SIDES}


def test_an_open_exit_leads_into_a_closed_chamber():
    place = layout(scene_of(INFILTRATION, {"specimen.exit": "open"}))
    assert place.high[0] == 0.04
    assert "x+" in place.walls
    assert place.sections == {"entrance": 0.0, "middle": 0.01}


def test_the_reservoir_follows_from_count_and_fraction():
    scene = scene_of(shipped("infiltration"))
    place = layout(scene)
    # The paper's reservoir: 0.205 m, three digits in physics.md.
    assert -place.low[0] == pytest.approx(0.205, abs=0.0005)
    assert particle_count(scene, place) == 21500
    filled = 21500 * mean_particle_volume_m3(scene.particles)
    assert filled / (0.01 * -place.low[0]) == pytest.approx(0.15, rel=1e-12)


def test_the_fraction_follows_from_count_and_reservoir():
    scene = scene_of(INFILTRATION)
    expected = 40 * mean_particle_volume_m3(scene.particles) / (0.03 * 0.02 * 0.02)
    assert particle_fraction(scene, layout(scene)) == pytest.approx(expected, rel=1e-12)


def test_the_count_follows_from_fraction_and_reservoir():
    scene = scene_of(INFILTRATION, {"particles.count": GONE, "particles.volume_fraction": 0.1})
    place = layout(scene)
    count = particle_count(scene, place)
    # A whole number of particles: within half of one.
    asked = 0.1 * 0.03 * 0.02 * 0.02 / mean_particle_volume_m3(scene.particles)
    assert abs(count - asked) <= 0.5
    assert particle_fraction(scene, place) == 0.1


def test_mean_volume_is_that_of_the_truncated_gaussian():
    """E[r^3] of a Gaussian cut at k deviations, by direct quadrature."""
    scene = scene_of(INFILTRATION, {"particles.radius_truncation": 1.5})
    z = np.linspace(-1.5, 1.5, 20001)
    weight = np.exp(-(z**2) / 2)
    cubes = (0.0015 + 0.0001 * z) ** 3
    expected = 4 / 3 * math.pi * trapezoid(cubes * weight, z) / trapezoid(weight, z)
    # The trapezoidal rule with 20000 intervals errs by 1e-9.
    assert mean_particle_volume_m3(scene.particles) == pytest.approx(expected, rel=1e-7)


def test_a_box_is_as_given():
    changes = {"box.walls": ["y-", "x+"]}
    place = layout(scene_of(COLLISION, changes))
    assert (place.low, place.high) == ((-0.02, -0.005, -0.005), (0.02, 0.005, 0.005))
    assert (place.fill_low, place.fill_high) == (place.low, place.high)
    assert set(place.walls) == {"y-", "x+"}
    assert place.sections == {}


def test_a_suspension_may_fill_part_of_a_box():
    changes = {
        "particles": {**MATERIAL, "radius_mean": 0.0005, "volume_fraction": 0.05},
        "spheres": GONE,
        "reservoir": {"length": 0.01},
    }
    scene = scene_of(COLLISION, changes)
    place = layout(scene)
    assert place.fill_high == pytest.approx((-0.01, 0.005, 0.005), rel=1e-12)
    asked = 0.05 * 0.01**3 / (4 / 3 * math.pi * 0.0005**3)
    assert particle_count(scene, place) == round(asked)


def test_a_suspension_must_fit_into_its_box():
    with pytest.raises(Exception, match=r"reservoir\.length"):
        scene_of(COLLISION, {"reservoir": {"length": 1.0}})


def test_a_scene_without_a_suspension_has_none():
    scene = scene_of(COLLISION)
    assert particle_count(scene, layout(scene)) == 0
    assert particle_fraction(scene, layout(scene)) == 0.0


def test_every_key_is_documented_with_its_unit():
    schema = scene_schema()
    tables = {"Scene": schema, **schema["$defs"]}
    undocumented = [
        f"{table}.{key}"
        for table, content in tables.items()
        for key, field in content["properties"].items()
        if not ({"description", "unit"} <= set(field) or "$ref" in str(field))
    ]
    assert not undocumented
