"""Dense packings, periodic and between walls, and the front door's choice of method."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.distance import cdist, pdist

from liggghts_driver.errors import PackingError
from liggghts_driver.packing import (
    Spheres,
    pack_periodic,
    place_sequentially,
    place_spheres,
    relaxation,
    sample_radii,
)

NEIGHBOUR_BOXES = np.array([s for s in np.ndindex(3, 3, 3) if s != (1, 1, 1)]) - 1


def periodic_gap(spheres, edges) -> float:
    """Smallest surface distance between spheres and all images, by brute force."""
    r, x = spheres.radii_m, spheres.centres_m
    sums = r[:, np.newaxis] + r
    gap = np.min(pdist(x) - sums[np.triu_indices(len(r), 1)], initial=np.inf)
    images = [np.min(cdist(x, x + shift * edges) - sums) for shift in NEIGHBOUR_BOXES]
    return min(gap, *images)


def edges_for(radii, fraction, shape=(1.0, 1.0, 1.0)):
    volume = 4.0 / 3.0 * np.pi * np.sum(radii**3) / fraction
    return np.array(shape) * (volume / np.prod(shape)) ** (1.0 / 3.0)


@pytest.mark.parametrize("fraction", [0.05, 0.4, 0.55, 0.62])
@pytest.mark.parametrize("deviation", [0.0, 1e-3, 2e-3])
def test_no_overlap_across_the_boundary(fraction, deviation):
    rng = np.random.default_rng(2)
    radii = sample_radii(0.01, deviation, 200, rng)
    edges = edges_for(radii, fraction, (1.0, 1.2, 0.8))
    spheres = pack_periodic(radii, edges, rng)
    assert np.array_equal(spheres.radii_m, radii)
    assert spheres.volume_m3 / np.prod(edges) == pytest.approx(fraction, rel=1e-12)
    # The gap kept is 1e-6 of the smallest radius, 4e-9 m at least; rounding is 1e-16 m.
    assert periodic_gap(spheres, edges) > 0.0
    assert np.all((spheres.centres_m >= 0.0) & (spheres.centres_m < edges))


def test_a_few_spheres_in_a_narrow_periodic_box():
    radii = np.ones(3)
    edges = np.array([4.7, 4.7, 4.7])
    assert periodic_gap(pack_periodic(radii, edges, np.random.default_rng(0)), edges) > 0.0


def test_a_periodic_packing_has_no_preferred_place():
    rng = np.random.default_rng(5)
    radii = sample_radii(0.01, 0.001, 1500, rng)
    edges = edges_for(radii, 0.55)
    thirds = np.histogram(pack_periodic(radii, edges, rng).centres_m[:, 0] / edges[0], 3, (0, 1))
    # Independent points would scatter by 18 about 500; a dense packing by far less.
    assert np.all(np.abs(thirds[0] - 500) < 40)


def test_same_seed_gives_the_same_bytes():
    def made(seed: int) -> bytes:
        radii = np.full(100, 1.0)
        rng = np.random.default_rng(seed)
        return pack_periodic(radii, edges_for(radii, 0.55), rng).centres_m.tobytes()

    assert made(8) == made(8)
    assert made(8) != made(9)


def test_periodic_above_the_limit_is_refused_at_once():
    rng = np.random.default_rng(0)
    before = rng.bit_generator.state
    radii = np.ones(100)
    with pytest.raises(PackingError, match=r"would fill 0\.630 .* 0\.64 \(random close packing\)"):
        pack_periodic(radii, edges_for(radii, 0.63), rng)
    assert rng.bit_generator.state == before


@pytest.mark.parametrize("edge", [4.5, 0.0, -5.0, np.nan])
def test_a_too_narrow_periodic_box_is_refused(edge):
    with pytest.raises(PackingError, match="too narrow"):
        pack_periodic(np.ones(1), [10.0, 10.0, edge], np.random.default_rng(0))


GRAINS = Spheres(
    np.array([[6.0, -10.0, 0.0], [8.0, 10.0, 2.0], [-1.0, 0.0, 14.0]]), np.array([10.0, 9.0, 5.0])
)
LOW, HIGH = np.array([-12.0, -15.0, -15.0]), np.array([0.0, 15.0, 15.0])
# The box less what four million random points found inside the grains, 648.7 +- 1.3.
FREE_VOLUME = 12.0 * 30.0 * 30.0 - 648.7


@pytest.mark.parametrize("fraction", [0.15, 0.35, 0.5])
@pytest.mark.parametrize("clearance", [0.0, 0.02])
def test_no_overlap_between_walls_and_obstacles(fraction, clearance):
    rng = np.random.default_rng(3)
    radii = sample_radii(1.0, 0.07, int(fraction * FREE_VOLUME / 4.25), rng)
    spheres = place_spheres(radii, LOW, HIGH, rng, obstacles=GRAINS, clearance_m=clearance)
    r, x = radii[:, np.newaxis], spheres.centres_m
    assert np.array_equal(spheres.radii_m, radii)
    # A gap of 1e-6 of a radius is kept on top of the clearance; rounding is 1e-14.
    assert np.min(pdist(x) - (r + radii)[np.triu_indices(len(radii), 1)]) > clearance
    assert np.min([x - r - LOW, HIGH - x - r]) > clearance
    assert np.min(cdist(x, GRAINS.centres_m) - r - GRAINS.radii_m) > clearance


def test_sequential_addition_serves_the_dilute_case():
    radii = np.full(50, 0.1)  # 0.21 of the unit cube
    box = (np.zeros(3), np.ones(3))
    by_door = place_spheres(radii, *box, np.random.default_rng(6))
    directly = place_sequentially(radii, *box, np.random.default_rng(6))
    # The same random numbers, up to the door's gap of 1e-6 of a radius.
    assert np.allclose(by_door.centres_m, directly.centres_m, atol=1e-6)


def test_relaxation_helps_where_sequential_addition_is_stuck():
    # A tube little wider than a sphere, whose length sequential addition cannot fill.
    radii, high = np.ones(40), np.array([100.0, 2.6, 2.6])  # filled to 0.248
    with pytest.raises(PackingError, match="placed 3"):
        place_sequentially(radii, np.zeros(3), high, np.random.default_rng(0))
    spheres = place_spheres(radii, np.zeros(3), high, np.random.default_rng(0))
    assert np.min(pdist(spheres.centres_m)) > 2.0


def test_between_walls_above_the_limit_is_refused_at_once():
    rng = np.random.default_rng(0)
    before = rng.bit_generator.state
    with pytest.raises(PackingError, match=r"fill 0\.628 .* 0\.64 .* above 0\.6 nothing is tried"):
        place_spheres(np.full(150, 0.1), np.zeros(3), np.ones(3), rng)
    assert rng.bit_generator.state == before


def test_a_stall_is_noticed_and_says_what_was_asked_and_reached(monkeypatch):
    # A stalled state keeps its energy, so the steps left need not be used up.
    monkeypatch.setattr(relaxation, "_MOST_STEPS", 10**9)
    # Ten radii wide: the walls leave room for about 0.53.
    with pytest.raises(PackingError, match=r"asked for 140 .* 0\.586; .* stalled, .* fill 0\.[45]"):
        place_spheres(np.full(140, 0.1), np.zeros(3), np.ones(3), np.random.default_rng(0))


@pytest.mark.parametrize("steps", [1, 30, 70, 95])
def test_an_unfinished_packing_is_never_returned(monkeypatch, steps):
    # This one takes some 105 steps; after 95 the deepest overlap is a thousandth of a radius.
    monkeypatch.setattr(relaxation, "_MOST_STEPS", steps)
    radii, rng = np.ones(200), np.random.default_rng(1)
    with pytest.raises(PackingError, match="stalled"):
        pack_periodic(radii, edges_for(radii, 0.55), rng)


def test_no_sphere_at_all_is_refused():
    with pytest.raises(PackingError, match="no sphere"):
        place_spheres(np.empty(0), np.zeros(3), np.ones(3), np.random.default_rng(0))
    with pytest.raises(PackingError, match="no sphere"):
        pack_periodic(np.empty(0), np.ones(3), np.random.default_rng(0))
