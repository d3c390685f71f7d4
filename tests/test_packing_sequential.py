"""Random sequential addition: what it places, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import cdist, pdist

from liggghts_driver.errors import PackingError
from liggghts_driver.packing import Spheres, place_sequentially, sample_radii

LOW, HIGH = np.array([-0.02, -0.015, -0.015]), np.array([0.0, 0.015, 0.015])


def smallest_gaps(spheres, low, high, obstacles=None) -> tuple[float, float, float]:
    """Smallest surface distances, by brute force: to each other, to the walls, to obstacles."""
    r, x = spheres.radii_m, spheres.centres_m
    upper = np.triu_indices(len(r), 1)
    pairs = np.min(pdist(x) - (r[:, np.newaxis] + r)[upper], initial=np.inf)
    walls = np.min([x - r[:, np.newaxis] - low, high - x - r[:, np.newaxis]])
    if obstacles is None:
        return pairs, walls, np.inf
    between = cdist(x, obstacles.centres_m) - r[:, np.newaxis] - obstacles.radii_m
    return pairs, walls, np.min(between)


@pytest.fixture
def grains() -> Spheres:
    """Fixed grains ten times larger than the particles, sticking into the box at x = 0."""
    centres = np.array([[0.006, -0.01, 0.0], [0.008, 0.01, 0.002], [-0.001, 0.0, 0.014]])
    return Spheres(centres, np.array([0.01, 0.009, 0.005]))


@pytest.mark.parametrize("clearance", [0.0, 2e-4])
def test_no_overlap_with_spheres_walls_or_obstacles(grains, clearance):
    rng = np.random.default_rng(1)
    radii = sample_radii(1e-3, 1e-4, 500, rng)
    spheres = place_sequentially(radii, LOW, HIGH, rng, obstacles=grains, clearance_m=clearance)
    assert np.array_equal(spheres.radii_m, radii)
    # Gaps are differences of lengths of 0.01 m: 1e-15 m is their rounding.
    assert min(smallest_gaps(spheres, LOW, HIGH, grains)) >= clearance - 1e-15


@settings(deadline=None, max_examples=25)
@given(
    seed=st.integers(0, 2**32 - 1),
    edges=st.tuples(*[st.floats(3.0, 12.0)] * 3),
    count=st.integers(1, 30),
    relative=st.floats(0.0, 0.3),
)
def test_any_box_gives_a_packing_or_a_reason(seed, edges, count, relative):
    rng = np.random.default_rng(seed)
    radii = sample_radii(0.5, 0.5 * relative, count, rng)
    low, high = -np.array(edges), np.zeros(3)
    try:
        spheres = place_sequentially(radii, low, high, rng)
    except PackingError as error:
        spheres, reason = None, str(error)
    if spheres is None:
        assert "saturates" in reason or "placed" in reason
    else:
        # Lengths of ten units: 1e-14 is their rounding.
        assert min(smallest_gaps(spheres, low, high)) >= -1e-14


def test_spheres_spread_evenly_and_whatever_their_size():
    rng = np.random.default_rng(4)
    radii = sample_radii(1e-3, 2e-4, 4000, rng)
    high = np.array([0.16, 0.03, 0.03])
    spheres = place_sequentially(radii, np.zeros(3), high, rng)
    x = spheres.centres_m[:, 0]
    slabs, _ = np.histogram(x, 8, (0.0, 0.16))
    # 500 per slab; independent points would scatter by 22, hard spheres by less, and the walls
    # shift about 500 / 20 * 0.5 = 12 out of an end slab.
    assert np.all(np.abs(slabs - 500) < 60)
    # Independent of place and of index: correlations scatter by 1 / sqrt(4000) = 0.016.
    assert abs(np.corrcoef(radii, x)[0, 1]) < 0.06
    assert abs(np.corrcoef(np.arange(4000), x)[0, 1]) < 0.06


def test_same_seed_gives_the_same_bytes(grains):
    def made(seed: int) -> bytes:
        radii = np.full(300, 1e-3)
        rng = np.random.default_rng(seed)
        return place_sequentially(radii, LOW, HIGH, rng, obstacles=grains).centres_m.tobytes()

    assert made(8) == made(8)
    assert made(8) != made(9)


def test_above_saturation_is_refused_at_once():
    rng = np.random.default_rng(0)
    before = rng.bit_generator.state
    radii = np.full(100, 0.1)  # 0.419 of the unit cube
    with pytest.raises(
        PackingError, match=r"100 spheres would fill 0\.419 .* saturates near 0\.38"
    ):
        place_sequentially(radii, np.zeros(3), np.ones(3), rng)
    assert rng.bit_generator.state == before


def test_obstacles_take_their_volume_from_the_free_one():
    # 80 spheres fill 0.335 of the cube, but 0.39 of what an obstacle's half leaves of it.
    radii, rng = np.full(80, 0.1), np.random.default_rng(0)
    obstacle = Spheres(np.array([[0.0, 0.5, 0.5]]), np.array([0.41]))
    with pytest.raises(PackingError, match=r"would fill 0\.39"):
        place_sequentially(radii, np.zeros(3), np.ones(3), rng, obstacles=obstacle)


def test_getting_stuck_says_what_was_asked_and_placed():
    # A tube little wider than a sphere: the line saturates at 0.75 of its length (Renyi), and 42
    # spheres of diameter 2 would take 0.84 of 100.
    with pytest.raises(PackingError, match=r"asked for 42 spheres, placed 3\d"):
        place_sequentially(np.ones(42), np.zeros(3), [100.0, 2.2, 2.2], np.random.default_rng(0))


@pytest.mark.parametrize(
    ("radii", "high", "clearance", "reason"),
    [
        ([], 1.0, 0.0, "no sphere"),
        ([0.1, 0.0], 1.0, 0.0, "not all positive"),
        ([0.1, np.nan], 1.0, 0.0, "not all positive"),
        ([0.6], 1.0, 0.0, "does not fit in a box 1 m wide"),
        ([0.45], 1.0, 0.1, "any clearance included"),
        ([0.1], -1.0, 0.0, "corners of a box"),
        ([0.1], 1.0, -0.1, "clearance"),
    ],
)
def test_senseless_requests_are_refused(radii, high, clearance, reason):
    with pytest.raises(PackingError, match=reason):
        place_sequentially(
            np.array(radii),
            np.zeros(3),
            np.full(3, high),
            np.random.default_rng(0),
            clearance_m=clearance,
        )
