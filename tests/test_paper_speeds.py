"""How fast particles go inside the specimen, by what counts as flowing: from made-up frames."""

from __future__ import annotations

import struct
from dataclasses import replace

import pytest
from paper_results import answer, linear, point, with_points

from liggghts_driver.deck.build import FRAME_COLUMNS
from liggghts_driver.errors import ParseError
from liggghts_driver.paper import law
from liggghts_driver.paper.agreement import velocity_sides
from liggghts_driver.paper.catalogue import GRADIENT, MAIN
from liggghts_driver.paper.choices import choices_answer, choices_table
from liggghts_driver.paper.speeds import ALL, mean_speeds_m_s
from liggghts_driver.paper.stored import Stored
from liggghts_driver.rundir import RunDirectory

FREE_M_S = law.free_flight_m_s(10.0)


@pytest.fixture
def run(tmp_path):
    made = RunDirectory(tmp_path / "run")
    made.dumps.mkdir(parents=True)
    made.write_scene(law.example())
    return made


def frame(run, step, *particles):
    """A frame with particles at some x [m] with some velocity along x [free flights]."""
    rows = [{"id": n, "x": x, "vx": speed * FREE_M_S} for n, (x, speed) in enumerate(particles, 1)]
    numbers = [float(row.get(name, 0.0)) for row in rows for name in FRAME_COLUMNS]
    columns = len(FRAME_COLUMNS)
    head = struct.pack("<qqi6i6dii", step, len(rows), 0, *[1] * 6, *[0.0] * 6, columns, 1)
    data = struct.pack(f"<i{len(numbers)}d", len(numbers), *numbers)
    (run.dumps / f"particles.{step:010d}.bin").write_bytes(head + data)


class TestOneRun:
    def test_means_of_what_is_inside_and_fast_enough(self, run):
        """-0.2, 0.05, 0.3, 0.6 and 1.0 of free flight inside; others before and behind it."""
        inside = [(0.01 * (n + 1), s) for n, s in enumerate((-0.2, 0.05, 0.3, 0.6, 1.0))]
        frame(run, 100, (-0.01, 9.0), (0.101, 9.0), *inside)
        found = {name: speed / FREE_M_S for name, speed in mean_speeds_m_s(run).items()}
        assert found == pytest.approx({ALL: 0.35, "0.1": 1.9 / 3.0, "0.5": 0.8, "0.8": 1.0})

    def test_only_the_second_half_of_the_frames_enters(self, run):
        for step in range(0, 101, 10):
            frame(run, step, (0.05, 0.2 if step < 50 else 0.6))
        assert mean_speeds_m_s(run)["0.1"] == pytest.approx(0.6 * FREE_M_S)

    def test_frames_weigh_by_their_particles(self, run):
        frame(run, 90, (0.05, 0.2), (0.06, 0.2), (0.07, 0.2))
        frame(run, 100, (0.05, 0.6))
        assert mean_speeds_m_s(run)[ALL] == pytest.approx(0.3 * FREE_M_S)

    def test_what_is_nowhere_is_left_out(self, run):
        frame(run, 100, (0.05, 0.2))
        assert set(mean_speeds_m_s(run)) == {ALL, "0.1"}

    def test_without_frames_there_is_nothing(self, run):
        assert mean_speeds_m_s(run) == {}

    def test_a_frame_that_is_cut_off(self, run):
        frame(run, 100, (0.05, 0.2))
        (path,) = run.frame_files()
        path.write_bytes(path.read_bytes()[:-8])
        with pytest.raises(ParseError, match="cut"):
            mean_speeds_m_s(run)


def at_one(*faster_m_s):
    """The first reading at 1 Pa/m, 0.5 mm/s in each packing, and these means of all inside."""
    found = [answer(1e-6, velocity_m_s=5e-4)] * len(faster_m_s)
    points = tuple(
        point({GRADIENT: 1.0}, n, replace_faster(each, speed))
        for n, (each, speed) in enumerate(zip(found, faster_m_s, strict=True))
    )
    return Stored({"gradient": with_points(linear(), "gradient", points)})


def replace_faster(found, speed):
    return found if speed is None else replace(found, faster_m_s={ALL: speed})


class TestWhatCounts:
    @pytest.mark.parametrize(
        ("speeds", "side"),
        [
            ((3.5e-4, 3.6e-4), "above it with all counted"),
            ((3.5e-4, None), "above it"),
            ((3.5e-4, 3.6e-4, None), "above it with all counted"),
            ((3.5e-4, 2.0e-4), "above it"),
            ((None, None), "above it"),
            ((3.5e-4,), "one packing"),
        ],
    )
    def test_more_than_the_paper_whatever_counts(self, speeds, side):
        """It prints 0.269 to 0.294 mm/s; any choice of some is faster than all are on average."""
        assert velocity_sides(at_one(*speeds), MAIN) == {side: ["1"]}

    def test_the_table_has_them_over_free_flight(self):
        row = choices_table(at_one(3e-4, 4e-4, None)).splitlines()[2]
        free = law.free_flight_m_s(1.0)
        assert (
            f"| with the piston | 1 | {3.5e-4 / free:.2f} | – | – | – | 0.53 to 0.58 | 2 |" == row
        )

    def test_without_frames_the_table_says_of_how_many(self):
        assert choices_table(at_one(None)).splitlines()[2].endswith("0.53 to 0.58 | 0 |")

    @pytest.mark.parametrize(("at_ten", "rises"), [(1.0, False), (9.0, True)])
    def test_whether_a_choice_makes_it_rise(self, at_ten, rises):
        """Half of free flight at 1 Pa/m; the paper's share rises by a factor of 1.8."""
        points = tuple(
            point({GRADIENT: g}, 0, replace_faster(answer(1e-6), share * law.free_flight_m_s(g)))
            for g, share in ((1.0, 0.5), (10.0, 0.1 * at_ten))
        )
        stored = Stored({"gradient": with_points(linear(), "gradient", points)})
        words = choices_answer(stored)
        assert "a factor of 1.8 in the paper" in words
        assert f"of {0.2 * at_ten:.2g}" in words
        assert ("no choice makes it rise" in words) != rises

    def test_without_any_run_there_is_nothing_to_say(self):
        assert choices_answer(Stored()) == ""
