"""The volume that a sphere shares with a box, against geometry, sampling and its own sum rules."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from liggghts_driver.packing import Spheres, meets_box, sphere_box_volume

BALL = 4.0 / 3.0 * np.pi
LOW, HIGH = np.array([-2.0, -3.0, -4.0]), np.array([5.0, 6.0, 7.0])
# Closed forms on both sides: only rounding of numbers of order one separates them.
ROUNDING = 1e-13


def one(centre, radius=1.0, low=LOW, high=HIGH) -> float:
    sphere = Spheres(np.array([centre], dtype=float), np.array([radius]))
    return float(sphere_box_volume(sphere, low, high)[0])


@pytest.mark.parametrize(
    ("centre", "part"),
    [
        ((1.0, 1.0, 1.0), 1.0),
        ((-1.0, 1.0, 1.0), 1.0),  # touching a face from within
        ((-2.0, 1.0, 1.0), 0.5),  # on a face
        ((1.0, 6.0, 7.0), 0.25),  # on an edge
        ((5.0, -3.0, 7.0), 0.125),  # on a corner
        ((-3.0, 1.0, 1.0), 0.0),  # touching from outside
        ((9.0, 1.0, 1.0), 0.0),
    ],
)
def test_whole_half_quarter_eighth_nothing(centre, part):
    assert one(centre) == pytest.approx(part * BALL, abs=ROUNDING)


@pytest.mark.parametrize("height", [1e-3, 0.3, 1.0, 1.7])
def test_cap(height):
    # The face x = -2 leaves a cap of this height within the box.
    expected = np.pi * height**2 * (3.0 - height) / 3.0
    assert one((-3.0 + height, 1.0, 1.0)) == pytest.approx(expected, abs=ROUNDING)


def test_box_within_the_ball():
    assert one((0.5, 0.0, 0.0), 40.0) == pytest.approx(7 * 9 * 11, rel=ROUNDING)


def test_column_through_the_ball():
    # A square column of side 2 s through the centre of the unit ball, from the half-known
    # integral of 2 sqrt(1 - x^2 - y^2) over the square, done on a fine midpoint grid.
    side, cells = 0.6, 2000
    x = (np.arange(cells) + 0.5) / cells * side
    heights = np.sqrt(1.0 - x[:, np.newaxis] ** 2 - x**2)
    expected = 8.0 * heights.sum() * (side / cells) ** 2
    box = np.array([side, side, 3.0])
    # The midpoint rule errs by the cell's square times the curvature: 1e-7.
    assert one((0.0, 0.0, 0.0), 1.0, -box, box) == pytest.approx(expected, abs=3e-7)


def test_against_sampling():
    rng = np.random.default_rng(11)
    low, high = np.array([-0.5, -0.4, -0.6]), np.array([0.7, 0.8, 0.5])
    points = low + (high - low) * rng.random((200_000, 3))
    spheres = Spheres(rng.uniform(-1.0, 1.0, (40, 3)), rng.uniform(0.2, 1.3, 40))
    volume = float(np.prod(high - low))
    for centre, radius, shared in zip(
        spheres.centres_m, spheres.radii_m, sphere_box_volume(spheres, low, high), strict=True
    ):
        part = np.mean(np.sum((points - centre) ** 2, axis=1) < radius**2)
        error = volume * np.sqrt(max(part * (1.0 - part), 1e-5) / len(points))
        # Forty comparisons: beyond four standard errors once in four hundred sets; fixed seed.
        assert abs(shared - volume * part) < 4.0 * error


coordinate = st.floats(-2.0, 2.0)


@given(
    centre=st.tuples(coordinate, coordinate, coordinate),
    radius=st.floats(0.05, 3.0),
    cut=st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)),
)
def test_the_parts_of_a_cut_box_add_up(centre, radius, cut):
    """Eight boxes that share a corner anywhere hold what the whole box holds."""
    ends = np.array([[-1.0] * 3, cut, [1.0] * 3])
    parts = 0.0
    for i, j, k in np.ndindex(2, 2, 2):
        low = ends[[i, j, k], range(3)]
        high = ends[[i + 1, j + 1, k + 1], range(3)]
        parts += one(centre, radius, low, high)
    whole = one(centre, radius, ends[0], ends[2])
    # 64 octants of magnitude radius cubed, each exact to a few roundings; arctan2 near a kink
    # can magnify these to the square root's own error, still below 1e-10.
    assert parts == pytest.approx(whole, abs=1e-10 * max(1.0, radius**3))
    assert -1e-12 <= whole <= min(8.0, BALL * radius**3) * (1.0 + 1e-12) + 1e-12


def test_meeting_a_box_is_sharing_volume():
    rng = np.random.default_rng(2)
    spheres = Spheres(rng.uniform(-6.0, 10.0, (5000, 3)), rng.uniform(0.5, 2.0, 5000))
    shared = sphere_box_volume(spheres, LOW, HIGH)
    # Rounding leaves some 1e-16 of a sphere outside; a sphere that only grazes the box by 1e-6
    # of its radius shares 1e-12, and none of the 5000 comes that close.
    assert np.array_equal(meets_box(spheres, LOW, HIGH), shared > 1e-12)
    assert 0.2 < np.mean(shared > 1e-12) < 0.8


def test_a_sphere_beyond_a_corner_can_miss_a_box_that_its_bounding_box_meets():
    sphere = Spheres(np.array([HIGH + 0.6]), np.array([1.0]))  # 0.6 sqrt(3) > 1
    assert not meets_box(sphere, LOW, HIGH)[0]
    assert one(HIGH + 0.6) == pytest.approx(0.0, abs=ROUNDING)


def test_volume_of_spheres():
    spheres = Spheres(np.zeros((2, 3)), np.array([1.0, 2.0]))
    assert spheres.volume_m3 == pytest.approx(9.0 * BALL, rel=ROUNDING)
    assert len(spheres) == 2


def test_mismatched_arrays_are_refused():
    with pytest.raises(ValueError, match=r"not \(n, 3\)"):
        Spheres(np.zeros((2, 3)), np.ones(3))
