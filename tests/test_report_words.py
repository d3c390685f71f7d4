from __future__ import annotations

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_scenes import COLLISION, INFILTRATION, scene_of, shipped

from liggghts_driver.report.listing import scene_listing
from liggghts_driver.report.numbers import number, quantity, unit_for, with_error
from liggghts_driver.scene import make_scene


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (None, 3, "–"),
        (0.0, 3, "0"),
        (0, 3, "0"),
        (2619, 3, "2619"),
        (162500, 3, "162\u202f500"),
        (-1234567, 3, "\u22121\u202f234\u202f567"),
        (0.55, 3, "0.550"),
        (1.37056, 3, "1.37"),
        (-1.98, 2, "\u22122.0"),
        (0.00123, 2, "0.0012"),
        (36277.7, 3, "36\u202f278"),
        (5.4328e6, 3, "5.43 × 10⁶"),
        (-6.7e-7, 3, "\u22126.70 × 10⁻⁷"),
    ],
)
def test_numbers_are_short(value, digits, text):
    assert number(value, digits) == text


@pytest.mark.parametrize(
    ("value", "dimension", "text"),
    [
        (0.0, "s", "0 s"),
        (1.35e-4, "s", "0.135 ms"),
        (78.3, "s", "78.3 s"),
        (6.67e-7, "m³/s", "0.667 cm³/s"),
        (-2.77e-3, "m/s", "\u22122.77 mm/s"),
        (1.49e-3, "N", "1.49 mN"),
        (2e-14, "J", "0.0200 pJ"),
    ],
)
def test_quantities_have_a_unit_that_fits(value, dimension, text):
    assert quantity(value, dimension) == text


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (0.66677, 0.0674, "0.667 ± 0.067"),
        (1.649, 1.32, "1.6 ± 1.3"),
        (1234.5, 56.0, "1234 ± 56"),
        (0.5, None, "0.500"),
        (0.5, 0.0, "0.500"),
    ],
)
def test_errors_decide_the_digits(value, error, text):
    assert with_error(value, error) == text


@given(st.floats(1e-30, 1e30), st.sampled_from(["s", "m", "m/s", "m³", "m³/s", "N", "J"]))
def test_a_unit_is_a_power_of_ten_that_keeps_the_value(value, dimension):
    unit = unit_for(dimension, value)
    assert unit.of(value) * unit.size == pytest.approx(value, rel=1e-15)  # rounding of a division
    assert unit.of(value) >= 0.1 or unit == unit_for(dimension, 1e-300)


@pytest.mark.parametrize(
    "tables",
    [
        *(shipped(name) for name in ("infiltration", "infiltration_small", "two_spheres")),
        COLLISION,
        INFILTRATION,
        {**COLLISION, "title": 'a "quoted" \\ title\twith <&> and ü'},
    ],
)
def test_a_listing_is_a_scene_file_of_the_same_scene(tables):
    scene = scene_of(tables)
    assert make_scene(tomllib.loads(scene_listing(scene))) == scene


def test_a_listing_has_units_and_defaults_but_no_empty_tables():
    listing = scene_listing(scene_of(COLLISION))
    assert "radius = 0.0015  # m\n" in listing
    assert "\nlargest_overlap = 0.01\n" in listing
    assert "[reservoir]" not in listing
    assert "[fluid]" not in listing
