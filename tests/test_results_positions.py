"""What is counted from the frames themselves: volumes past the sections, and overlaps."""

from __future__ import annotations

import itertools
import math
import struct

import numpy as np
import pytest
from small_scenes import COLLISION, GRAIN, INFILTRATION, MATERIAL, case_of

from liggghts_driver.errors import ParseError
from liggghts_driver.results.positions import (
    iter_instants,
    largest_overlap_over_radius,
    volumes_past_sections,
)
from liggghts_driver.rundir import RunDirectory

GRAINS = {"youngs_modulus": 1.0e6, "poissons_ratio": 0.25}


@pytest.fixture
def run(tmp_path):
    directory = RunDirectory(tmp_path)
    directory.dumps.mkdir()
    return directory


def write_frame(run, step: int, positions, order=None, velocities=None) -> None:
    """One frame as the engine writes it: a header, then blocks of seven numbers per particle."""
    positions = np.asarray(positions, dtype=float)
    velocities = np.zeros_like(positions) if velocities is None else np.asarray(velocities)
    ids = np.arange(1.0, len(positions) + 1)
    rows = np.column_stack([ids, positions, velocities])
    rows = rows if order is None else rows[order]
    head = struct.pack("<qqi6i6dii", step, len(rows), 0, *[1] * 6, *[-1.0, 1.0] * 3, 7, 1)
    body = struct.pack("<i", rows.size) + rows.astype("<f8").tobytes()
    (run.dumps / f"particles.{step:010d}.bin").write_bytes(head + body)


def test_instants_are_in_the_order_of_time_and_ids(run):
    places = [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6], [0.7, 0.8, 0.9]]
    write_frame(run, 200, places, order=[2, 0, 1], velocities=-np.asarray(places))
    write_frame(run, 0, np.zeros((3, 3)))
    first, second = iter_instants(run)
    assert (first.step, second.step) == (0, 200)
    assert second.positions_m.tolist() == places
    assert second.velocities_m_s.tolist() == (-np.asarray(places)).tolist()


def test_a_frame_that_is_cut_off_is_not_passed_over(run):
    write_frame(run, 0, np.zeros((3, 3)))
    write_frame(run, 10, np.zeros((3, 3)))
    last = run.frame_files()[-1]
    last.write_bytes(last.read_bytes()[:-8])
    with pytest.raises(ParseError):
        list(iter_instants(run))


def test_volumes_past_sections(run):
    case = case_of(INFILTRATION)
    volumes = 4 / 3 * math.pi * case.population.particle_radii_m**3
    start = case.population.centres_m[:40]
    moved = start.copy()
    moved[3, 0], moved[7, 0] = 0.001, 0.011
    write_frame(run, 0, start)
    write_frame(run, 50, moved, order=np.random.default_rng(1).permutation(40))
    table = volumes_past_sections(run, case)
    assert table["step"].tolist() == [0, 50]
    expected = [0.0, volumes[3] + volumes[7]]
    assert table["volume_entrance_m3"].tolist() == pytest.approx(expected, rel=1e-12)
    assert table["volume_middle_m3"].tolist() == pytest.approx([0.0, volumes[7]], rel=1e-12)


class TestOverlap:
    def overlap(self, run, case, positions) -> float:
        write_frame(run, 0, positions)
        return largest_overlap_over_radius(run, case)

    def test_none(self, run):
        case = case_of(COLLISION)
        assert self.overlap(run, case, case.population.centres_m) == 0.0

    def test_of_a_place_that_is_no_number(self, run):
        """Such a run may be whole before anybody looked; its verdict is then "invalid"."""
        case = case_of(COLLISION)
        write_frame(run, 0, case.population.centres_m)
        write_frame(run, 1, [[0.0, 0.0, 0.0], [0.0, math.nan, 0.0]])
        assert math.isnan(largest_overlap_over_radius(run, case))

    def test_of_two_spheres(self, run):
        spheres = [{**COLLISION["spheres"][0], "radius": 0.001}, COLLISION["spheres"][1]]
        case = case_of(COLLISION, {"spheres": spheres})
        found = self.overlap(run, case, [[0.0, 0.0, 0.0], [0.0024, 0.0, 0.0]])
        # 0.1 mm of the smaller radius of 1 mm; rounding of coordinates of millimetres.
        assert found == pytest.approx(0.1, rel=1e-12)

    def test_with_a_grain(self, run):
        changes = {"spheres": [COLLISION["spheres"][0], GRAIN], "grains": GRAINS}
        case = case_of(COLLISION, changes)
        found = self.overlap(run, case, [[0.01, 0.0, 0.0034]])
        assert found == pytest.approx(0.1e-3 / 1.5e-3, rel=1e-12)

    @pytest.mark.parametrize(
        ("face", "place"), [("y-", [0, -0.0036, 0]), ("y+", [0, 0.0036, 0]), ("x+", [0.0186, 0, 0])]
    )
    def test_with_a_wall(self, run, face, place):
        changes = {"spheres": COLLISION["spheres"][:1], "box.walls": [face]}
        found = self.overlap(run, case_of(COLLISION, changes), [place])
        assert found == pytest.approx(0.1e-3 / 1.5e-3, rel=1e-10)

    def test_an_open_face_is_no_wall(self, run):
        case = case_of(COLLISION, {"spheres": COLLISION["spheres"][:1]})
        assert self.overlap(run, case, [[0.0199, 0.0, 0.0]]) == 0.0

    def test_of_all_frames_the_worst(self, run):
        case = case_of(COLLISION)
        for step, gap in enumerate([0.0031, 0.0029, 0.0030]):
            write_frame(run, step, [[0.0, 0.0, 0.0], [gap, 0.0, 0.0]])
        assert largest_overlap_over_radius(run, case) == pytest.approx(0.1 / 1.5, rel=1e-10)

    @pytest.mark.parametrize("seed", range(5))
    def test_of_a_crowd_against_all_pairs_one_by_one(self, run, seed):
        particles = {**MATERIAL, "radius_mean": 0.001, "radius_deviation": 0.0002, "count": 40}
        changes = {"particles": particles, "spheres": [GRAIN], "grains": GRAINS}
        case = case_of(COLLISION, {**changes, "box.walls": ["x-", "z+"], "seed": seed})
        rng = np.random.default_rng(seed)
        low, high = np.array(case.layout.low), np.array(case.layout.high)
        places = rng.uniform(low + 0.0005, high - 0.0005, (40, 3))
        radii = case.population.particle_radii_m
        worst = [0.0]
        for i, j in itertools.combinations(range(40), 2):
            depth = radii[i] + radii[j] - math.dist(places[i], places[j])
            worst.append(depth / min(radii[i], radii[j]))
        for place, radius in zip(places, radii, strict=True):
            depth = radius + 0.002 - math.dist(place, GRAIN["position"])
            worst.append(depth / min(radius, 0.002))
            worst.append((radius - (place[0] - low[0])) / radius)
            worst.append((radius - (high[2] - place[2])) / radius)
        assert self.overlap(run, case, places) == pytest.approx(max(worst), rel=1e-9)

    def test_with_the_piston(self, run):
        changes = {"spheres": COLLISION["spheres"][:1]}
        case = case_of(COLLISION, {**changes, "piston": {"acceleration": 1.0, "mass": 1.0}})
        # At the start the piston stands at x = -0.02.
        assert self.overlap(run, case, [[-0.0186, 0.0, 0.0]]) > 0.05


def test_nothing_that_moves(run):
    case = case_of(COLLISION, {"spheres": [GRAIN], "grains": GRAINS})
    assert case.population.particles == 0
    write_frame(run, 0, np.empty((0, 3)))
    assert largest_overlap_over_radius(run, case) == 0.0
