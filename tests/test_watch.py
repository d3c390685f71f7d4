"""The watch during a run: every rule made to fire, and quiet just below; what it says and does."""

from __future__ import annotations

import json
import math
import struct
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from small_scenes import COLLISION, FLUID, GRAIN, INFILTRATION, case_of

from liggghts_driver.case import Checkpoint
from liggghts_driver.contacts import contacts_at, elastic_energy_j
from liggghts_driver.effects.drag_law import reynolds_bound
from liggghts_driver.engine.diagnose import lost_spheres
from liggghts_driver.engine.stop import Stop
from liggghts_driver.errors import RunError, RunInterrupted, RunUnstableError
from liggghts_driver.physics.contact import Body, largest_overlap_m
from liggghts_driver.results.energy import MARGIN, energy_budget
from liggghts_driver.results.verdict import STEP_TOLERANCE, contact_step_limit_s, judge
from liggghts_driver.run import run_case
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.watch import Watch
from liggghts_driver.watch.rules import SPEED_MARGIN

GRAINS = {"youngs_modulus": 1.0e6, "poissons_ratio": 0.25}
QUIET = {"step": 0.0, "kinetic_energy_j": 0.0, "largest_speed_m_s": 0.0}
#: Just below and just above a limit; far more than the rounding of the few sums in between.
BELOW, ABOVE = 1.0 - 1e-6, 1.0 + 1e-6


@pytest.fixture
def run(tmp_path):
    directory = RunDirectory(tmp_path)
    directory.dumps.mkdir()
    return directory


@pytest.fixture
def case():
    return case_of(COLLISION)


def write_series(run, *rows, end="\n") -> None:
    """What the deck's ``fix print`` writes."""
    lines = [" ".join(rows[0]), *(" ".join(map(repr, row.values())) for row in rows)]
    run.engine_series.write_text("\n".join(lines) + end)


def row(case, samples: int = 1, **values) -> dict[str, float]:
    """A quiet row of the series, changed."""
    return {**QUIET, "step": float(samples * case.time.sample_every), **values}


def write_frame(run, step: int, positions, velocities=None, ids=None) -> None:
    """One frame as the engine writes it."""
    positions = np.asarray(positions, dtype=float)
    velocities = np.zeros_like(positions) if velocities is None else np.asarray(velocities)
    ids = np.arange(1.0, len(positions) + 1) if ids is None else np.asarray(ids, dtype=float)
    rows = np.column_stack([ids, positions, velocities])
    head = struct.pack("<qqi6i6dii", step, len(rows), 0, *[1] * 6, *[-1.0, 1.0] * 3, 7, 1)
    body = struct.pack("<i", rows.size) + rows.astype("<f8").tobytes()
    (run.dumps / f"particles.{step:010d}.bin").write_bytes(head + body)


def judged_row(run, case, **values):
    """The finding of a run with one such row."""
    write_series(run, row(case, **values))
    return Watch(case, run).judge()


def judged_frame(run, case, positions, velocities=None, ids=None):
    """The finding of a run with one such frame."""
    write_frame(run, 0, positions, velocities, ids)
    return Watch(case, run).judge()


class TestRows:
    @pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
    @pytest.mark.parametrize("column", ["kinetic_energy_j", "largest_speed_m_s"])
    def test_what_is_not_a_number(self, run, case, column, value):
        found = judged_row(run, case, **{column: value})
        assert found.rule == "not a number"
        assert column in found.fault

    def test_the_engine_prints_it_with_a_sign_too(self, run, case):
        run.engine_series.write_text("step kinetic_energy_j largest_speed_m_s\n10 -nan 0\n")
        assert Watch(case, run).judge().rule == "not a number"

    def test_a_speed_at_which_contacts_are_not_resolved(self, run, case):
        limit = SPEED_MARGIN * case.speed_bound_m_s
        assert judged_row(run, case, largest_speed_m_s=BELOW * limit) is None
        found = judged_row(run, case, largest_speed_m_s=ABOVE * limit)
        assert (found.rule, found.limit) == ("speed", limit)
        assert f"{case.time.step_s:.3g} s" in found.fault
        assert "time.step_fraction" in found.advice

    def test_the_piston_in_the_grains(self, run):
        case = case_of(INFILTRATION, {"contact.largest_overlap": 0.02})
        assert judged_row(run, case, piston_x_m=case.layout.low[0]) is None
        found = judged_row(run, case, piston_x_m=0.0)  # where the specimen begins
        assert (found.rule, found.limit) == ("overlap", 0.2)
        assert "the piston overlaps grain" in found.fault
        assert "youngs_modulus" in found.advice

    def test_a_speed_that_the_verdict_lets_pass(self, run, case):
        """As many times faster, but the step is well below its bound."""
        fast = 1.01 * SPEED_MARGIN * case.speed_bound_m_s
        limit = contact_step_limit_s(case, fast)
        for share, fires in ((0.99, False), (1.01, True)):
            step = STEP_TOLERANCE * share * limit
            short = case_of(COLLISION, {"time.step": step})
            assert (judged_row(run, short, largest_speed_m_s=fast) is not None) == fires

    def test_a_speed_for_which_the_step_is_short_enough(self, run):
        """The verdict calls that valid, so the run goes on."""
        short = case_of(COLLISION, {"time.step": 1e-6, "time.duration": 0.001})
        fast = SPEED_MARGIN * 2.0 * short.speed_bound_m_s
        assert judged_row(run, short, largest_speed_m_s=fast) is None

    def test_more_kinetic_energy_than_the_scene_can_have(self, run, case):
        limit = energy_budget(case).limit_j
        assert judged_row(run, case, kinetic_energy_j=BELOW * limit) is None
        found = judged_row(run, case, kinetic_energy_j=ABOVE * limit)
        assert (found.rule, found.limit) == ("energy", limit)

    def test_a_reynolds_number_beyond_the_branches_in_the_deck(self, run):
        case = case_of(INFILTRATION)
        limit = reynolds_bound(case)
        piston = {"piston_x_m": case.layout.low[0]}
        below, above = ((factor * limit) ** 2 for factor in (BELOW, ABOVE))
        assert judged_row(run, case, largest_reynolds_squared=below, **piston) is None
        # Of no velocity that is a number the engine's largest is its smallest number.
        assert judged_row(run, case, largest_reynolds_squared=-1e20, **piston) is None
        found = judged_row(run, case, largest_reynolds_squared=above, **piston)
        assert (found.rule, found.limit) == ("reynolds", limit)

    def test_where_a_row_is_stopped_the_verdict_would_be_invalid(self, run, case):
        times = np.linspace(0.0, 0.1, 21)
        for column, value in (
            ("largest_speed_m_s", ABOVE * SPEED_MARGIN * case.speed_bound_m_s),
            ("kinetic_energy_j", ABOVE * energy_budget(case).limit_j),
            ("kinetic_energy_j", math.nan),
        ):
            assert judged_row(run, case, **{column: value}) is not None
            table = pd.DataFrame({"time_s": times, **dict.fromkeys(QUIET, 0.0 * times)})
            table[column] = value
            assert judge(case, table, {}, 0.0).verdict == "invalid"


#: Hertz's energy of one contact is far below the budget of a scene with spheres so fast.
FAST = {
    "spheres": [
        {**sphere, "velocity": [1000.0 * v for v in sphere["velocity"]]}
        for sphere in COLLISION["spheres"]
    ]
}


def pair(overlap: float):
    """Places of the spheres of COLLISION, radius 1.5 mm, with such an overlap over the radius."""
    return [[0.0, 0.0, 0.0], [0.0015 * (2.0 - overlap), 0.0, 0.0]]


class TestFrames:
    @pytest.mark.parametrize(
        ("allowed", "limit"), [(0.01, 0.1), (0.04, 0.4), (0.2, 0.5), (0.7, 0.7)]
    )
    def test_an_overlap_far_beyond_what_is_allowed(self, run, allowed, limit):
        case = case_of(COLLISION, {**FAST, "contact.largest_overlap": allowed})
        assert judged_frame(run, case, pair(BELOW * limit)) is None
        found = judged_frame(run, case, pair(ABOVE * limit))
        assert found.rule == "overlap"
        assert found.value == pytest.approx(limit, rel=2e-6)
        assert "particle 1 and particle 2" in found.where[0]
        assert "youngs_modulus" in found.advice

    def test_with_a_grain(self, run):
        case = case_of(COLLISION, {"spheres": [COLLISION["spheres"][0], GRAIN], "grains": GRAINS})
        found = judged_frame(run, case, [[0.01, 0.0, 0.0030]])
        assert "particle 1 and grain 2" in found.where[0]
        assert "0.333 of the smaller radius" in found.where[0]

    def test_through_a_wall(self, run):
        changes = {"spheres": COLLISION["spheres"][:1], "box.walls": ["x+"]}
        found = judged_frame(run, case_of(COLLISION, changes), [[0.0219, 0.0, 0.0]])
        assert "particle 1 and the wall x+, which it has gone through" in found.where[0]

    def test_with_the_piston_where_the_series_says_that_it_is(self, run):
        changes = {
            "spheres": COLLISION["spheres"][:1],
            "piston": {"acceleration": 1.0, "mass": 1.0},
        }
        case = case_of(COLLISION, changes)
        step = case.time.frame_every
        write_frame(run, 0, [[0.0, 0.0, 0.0]])
        write_frame(run, step, [[0.0, 0.0, 0.0]])
        samples = step // case.time.sample_every
        write_series(run, row(case, samples, piston_x_m=-0.0002))
        found = Watch(case, run).judge()
        assert found.step == step
        assert "the piston" in found.where[0]

    def test_the_energy_of_contacts_counts(self, run, case):
        case = case_of(COLLISION, {"contact.largest_overlap": 0.9})
        body = Body(0.0015, 7000.0 * 4 / 3 * math.pi * 0.0015**3, 1.0e7, 0.25)
        # The overlap in which the energy of a head-on collision is stored, at 5 times its energy.
        deepest = largest_overlap_m(body, body, 0.01 * math.sqrt(2.0 * (MARGIN + 1.0))) / 0.0015
        assert judged_frame(run, case, pair(0.5 * deepest)) is None
        found = judged_frame(run, case, pair(2.0 * deepest))
        assert found.rule == "energy"
        assert "elastic" in found.fault

    def test_a_missing_particle(self, run, case):
        found = judged_frame(run, case, [[0.0, 0.0, 0.0]], [[0.0, 0.0, 0.01]], ids=[2])
        assert found.rule == "lost"
        assert "1 of 2 particles are lost: 1" in found.fault
        assert any("next to leave: particle 2" in text for text in found.where)
        assert any("z+ (open)" in text for text in found.where)
        assert "open face (x-" in found.advice

    def test_where_a_missing_particle_was_seen_last(self, run, case):
        write_frame(run, 0, pair(-1.0))
        write_frame(run, case.time.frame_every, [[0.0, 0.0, 0.0]], ids=[1])
        found = Watch(case, run).judge()
        assert found.where[-1].startswith("in the frame before, of step 0: particle 2 at (0.0045,")

    @pytest.mark.parametrize("where", ["place", "velocity"])
    def test_a_particle_without_a_place(self, run, case, where):
        places, velocities = np.array(pair(0.0)), np.zeros((2, 3))
        (places if where == "place" else velocities)[1, 2] = math.nan
        found = judged_frame(run, case, places, velocities)
        assert found.rule == "not a number"
        assert "not a number for particles 2" in found.fault

    def test_a_quiet_frame(self, run, case):
        positions = case.population.centres_m
        assert judged_frame(run, case, positions, case.population.velocities_m_s) is None


class TestWhere:
    def test_the_fastest_particle_of_the_newest_frame(self, run, case):
        write_frame(run, 0, pair(-1.0))
        step = case.time.frame_every
        write_frame(run, step, pair(-1.0), [[0.0, 0.0, 0.0], [0.0, 3.0, 0.0]])
        write_series(run, row(case, 9, largest_speed_m_s=1e3))
        found = Watch(case, run).judge()
        assert found.step == 9 * case.time.sample_every
        assert found.time_s == pytest.approx(found.step * case.time.step_s, rel=1e-14)
        assert f"in the frame of step {step} " in found.where[0]
        assert "fastest: particle 2 at (0.0045, 0, 0) m, radius 0.0015 m" in found.where[0]
        assert "velocity (0, 3, 0) m/s" in found.where[0]
        assert "nothing touches" in found.where[1]

    def test_the_largest_slip_is_that_of_a_particle_at_rest_in_a_stream(self, run):
        fluid = {**FLUID, "velocity_outside": "constant", "velocity": 0.5}
        case = case_of(COLLISION, {"fluid": fluid})
        write_frame(run, 0, pair(-1.0), [[0.4, 0.0, 0.0], [0.0, 0.0, 0.0]])
        write_series(run, row(case, largest_reynolds_squared=1e30))
        assert "largest Re: particle 2" in Watch(case, run).judge().where[0]

    def test_before_the_first_frame(self, run, case):
        found = judged_row(run, case, kinetic_energy_j=math.nan)
        assert found.where == ("the run ended before its first frame was whole",)

    def test_an_explicit_step_is_what_to_change(self, run):
        case = case_of(COLLISION, {"time.step": case_of(COLLISION).time.step_s})
        found = judged_row(run, case, kinetic_energy_j=1e9)
        assert "shorter time.step than" in found.advice

    def test_softened_contacts_are_what_to_change(self, run):
        case = case_of(COLLISION, {**FAST, "contact.stiffness_scale": 0.5})
        found = judged_frame(run, case, pair(0.4))
        assert "raise contact.stiffness_scale above 0.5" in found.advice

    def test_of_many_lost_particles_the_first_are_named(self, run):
        case = case_of(INFILTRATION)
        found = judged_frame(run, case, case.population.centres_m[:30])
        assert "31, 32, 33, 34, 35 and 5 more" in found.fault

    def test_as_facts(self, run, case):
        found = judged_row(run, case, kinetic_energy_j=math.nan)
        facts = json.loads(json.dumps(found.as_facts(), allow_nan=False))
        assert facts["rule"] == "not a number"
        assert facts["step"] == case.time.sample_every


class TestReading:
    def test_nothing_is_there_yet(self, run, case):
        assert Watch(case, run).judge() is None

    def test_a_row_is_read_when_it_is_whole_and_once(self, run, case):
        watch = Watch(case, run)
        write_series(run, row(case), row(case, 2, kinetic_energy_j=math.nan), end="")
        assert watch.judge() is None
        with run.engine_series.open("a") as file:
            file.write("\n")
        assert watch.judge().step == 2 * case.time.sample_every

    def test_a_frame_is_read_when_it_is_whole(self, run, case):
        watch = Watch(case, run)
        write_frame(run, 0, pair(0.9))
        path = run.frame_files()[0]
        whole = path.read_bytes()
        for size in (0, 20, len(whole) - 1):
            path.write_bytes(whole[:size])
            assert watch.judge() is None
        path.write_bytes(whole)
        assert watch.judge().rule == "overlap"

    def test_an_older_frame_is_judged_while_the_newest_is_not_whole(self, run, case):
        write_frame(run, 0, pair(0.9))
        (run.dumps / f"particles.{case.time.frame_every:010d}.bin").write_bytes(b"")
        assert Watch(case, run).judge().step == 0

    def test_what_was_found_first_stays(self, run, case):
        watch = Watch(case, run)
        write_series(run, row(case, kinetic_energy_j=math.nan))
        first = watch.judge()
        write_frame(run, 0, pair(0.9))
        again = watch.judge()
        assert (again.rule, again.step) == (first.rule, first.step)

    def test_a_continuation_knows_what_came_before_it(self, run):
        """The piston's place at the checkpoint, and the frames of earlier launches."""
        piston = {"acceleration": 1.0, "mass": 1.0}
        case = case_of(COLLISION, {"piston": piston, "contact.largest_overlap": 0.4})
        step, samples = case.time.frame_every, case.time.frame_every // case.time.sample_every
        segment = RunDirectory(run.path / "segments" / "1")
        segment.dumps.mkdir(parents=True)
        write_frame(segment, 0, pair(-1.0))
        write_frame(segment, step, [[0.0, 0.0, 0.0], [0.003, 0.0, 0.0]])
        write_series(segment, row(case, samples, piston_x_m=-0.0002))
        then = replace(case, checkpoint=Checkpoint(1, step, "x", 0.0))
        write_frame(run, step, [[0.0, 0.0, 0.0], [0.003, 0.0, 0.0]])
        assert "the piston" in Watch(then, run).judge().where[0]
        (run.dumps / f"particles.{step:010d}.bin").unlink()
        later = replace(case, checkpoint=Checkpoint(1, step + case.time.sample_every, "x", 0.0))
        write_frame(run, 2 * step, [[0.003, 0.0, 0.0]], ids=[2])
        found = Watch(later, run).judge()
        assert found.where[-1].startswith(f"in the frame before, of step {step}: particle 1 at (0,")

    def test_a_continuation_begins_with_the_frame_of_its_checkpoint(self, run, case):
        step = case.time.frame_every
        then = Checkpoint(number=1, step=step, restart="x", piston_velocity_m_s=0.0)
        write_frame(run, step, pair(0.9))
        assert Watch(replace(case, checkpoint=then), run).judge().step == step


class TestLooking:
    def test_it_asks_for_a_checkpoint_once_and_waits_for_it(self, run, case, monkeypatch):
        monkeypatch.setattr("liggghts_driver.watch.look._EVERY_S", 0.0)
        monkeypatch.setattr("liggghts_driver.watch.look._SHARE", 1e9)
        asked: list[int] = []
        watch = Watch(case, run, lambda: asked.append(1), grace_s=1e3)
        write_series(run, row(case, kinetic_energy_j=1e9))
        for _ in range(3):
            watch.look()
        assert asked == [1]

    def test_it_waits_no_longer_than_it_is_told(self, run, case, monkeypatch):
        monkeypatch.setattr("liggghts_driver.watch.look._EVERY_S", 0.0)
        watch = Watch(case, run, grace_s=0.0)
        write_series(run, row(case, kinetic_energy_j=1e9))
        watch.look()
        monkeypatch.setattr("liggghts_driver.watch.look.time.monotonic", lambda: math.inf)
        with pytest.raises(RunUnstableError):
            watch.look()

    def test_for_what_is_not_a_number_there_is_no_checkpoint(self, run, case, monkeypatch):
        """Only the frame that tells which particle it was is waited for."""
        monkeypatch.setattr("liggghts_driver.watch.look._EVERY_S", 0.0)
        monkeypatch.setattr("liggghts_driver.watch.look._SHARE", 1e9)
        asked: list[int] = []
        watch = Watch(case, run, lambda: asked.append(1), grace_s=1e3)
        write_frame(run, 0, pair(-1.0))
        write_series(run, row(case, kinetic_energy_j=math.nan))
        watch.look()
        assert "nothing touches" in watch.finding.where[1]
        write_frame(run, case.time.frame_every, pair(math.nan))
        with pytest.raises(RunUnstableError, match="not a number: 2") as caught:
            watch.look()
        assert "in the frame before, of step 0: particle 2 at (0.0045, 0, 0)" in str(caught.value)
        assert not asked

    def test_it_does_not_look_all_the_time(self, run, case):
        watch = Watch(case, run)
        watch.look()
        write_series(run, row(case, kinetic_energy_j=math.nan))
        watch.look()  # at once after the first
        assert watch.finding is None


class TestARun:
    """With the stand-in for the engine, looked at whenever it prints something."""

    @pytest.fixture(autouse=True)
    def _often(self, monkeypatch):
        monkeypatch.setattr("liggghts_driver.watch.look._EVERY_S", 0.0)
        monkeypatch.setattr("liggghts_driver.watch.look._SHARE", 1e9)

    @pytest.fixture
    def failed(self, engine, case, tmp_path):
        def run(behaviour: str) -> tuple[RunDirectory, str]:
            engine(behaviour)
            directory = RunDirectory(tmp_path / "run")
            with pytest.raises(RunUnstableError) as caught:
                run_case(case, directory)
            return directory, str(caught.value)

        return run

    def test_it_is_stopped_at_a_checkpoint_and_named(self, failed, case):
        run, text = failed("wild")
        state = run.read_state()
        assert (state["state"], state["failures"]) == ("failed", 1)
        assert state["diagnosis"]["rule"] == "speed"
        assert text.startswith(f"the run was stopped: {state['faults'][0]}\n")
        assert "what to do:" in text
        assert str(run.path) in text
        # Stopped early, its state kept, and no segment to go on from.
        (restart,) = run.restarts.glob("*.restart")
        assert int(restart.name.split(".")[1]) < case.time.steps
        assert restart.name in text
        assert run.segments() == []

    @pytest.mark.parametrize("behaviour", ["wild", "nan", "error"])
    def test_the_very_same_is_not_run_again(self, failed, engine, case, behaviour):
        run, _ = failed(behaviour)
        before = {path: path.read_bytes() for path in run.path.rglob("*") if path.is_file()}
        engine("")  # is not launched
        with pytest.raises(RunUnstableError, match="not run again") as caught:
            run_case(case, run)
        assert run.read_state()["diagnosis"]["seen"] in str(caught.value)
        assert "remove the folder" in str(caught.value)
        claims = {path for path in before if path.name.startswith("claim")}
        assert all(path.read_bytes() == before[path] for path in before.keys() - claims)

    def test_with_another_number_of_processes_it_starts_anew(
        self, failed, engine, case, monkeypatch
    ):
        run, _ = failed("wild")
        engine("")
        monkeypatch.setenv("LIGGGHTS_DRIVER_LAUNCHER", "env")  # one engine
        assert run_case(case, run, ranks=2).thermo.rows["Step"].iloc[0] == 0
        assert json.loads((run.path / "attempt-1" / "run.json").read_text())["state"] == "failed"

    def test_it_does_not_go_on_from_a_checkpoint_before(self, engine, case, tmp_path):
        """What was found may have begun before the checkpoint, and would be found again."""
        run, stop = RunDirectory(tmp_path / "run"), Stop()
        engine("slow")
        with pytest.raises(RunInterrupted):
            run_case(case, run, on_step=lambda _: stop.asked or stop.ask(), stop=stop)
        assert len(run.segments()) == 1
        engine("wild")
        with pytest.raises(RunUnstableError, match="was stopped"):
            run_case(case, run)
        engine("")
        with pytest.raises(RunUnstableError, match="not run again"):
            run_case(case, run)
        state = run.read_state()
        run.write_state(**{**state, "engine": "another version"})
        assert run_case(case, run).thermo.rows["Step"].iloc[0] == 0
        assert run.segments() == []
        assert (run.path / "attempt-1" / "segments" / "1").exists()

    def test_it_is_ended_at_once_without_a_number(self, failed):
        run, text = failed("nan")
        assert "not a number in" in text
        assert run.read_state()["diagnosis"]["rule"] == "not a number"
        assert not list(run.restarts.glob("*"))

    def test_lost_spheres_are_explained_by_the_last_frame(self, failed):
        run, text = failed("error")
        state = run.read_state()
        assert state["diagnosis"]["rule"] == "lost"
        assert "the engine says: ERROR on proc 0: Atom lost" in text
        assert "deepest contact" in text or "nothing touches" in text
        assert "spheres left the engine's box" in state["faults"][0]

    @pytest.mark.parametrize(
        ("words", "lost"),
        [
            ("ERROR: Lost atoms: original 40 current 39 (thermo.cpp:402)", True),
            ("ERROR: Mesh (id piston): All 2 mesh elements have been lost", True),
            ("ERROR on proc 0: Angle atoms 1 2 3 missing on proc 0 at step 7", True),
            ("ERROR: dump local/gran is missing arguments (dump_local_gran.cpp:90)", False),
            ("ERROR: Missing implementation in calc_insertion_properties()", False),
        ],
    )
    def test_not_everything_that_is_missing_is_a_sphere(self, tmp_path, words, lost):
        run = RunDirectory(tmp_path)
        run.stdout.write_text(f"some words\n{words}\n", encoding="utf-8")
        assert lost_spheres(run) is lost

    def test_another_failure_has_no_diagnosis(self, engine, case, tmp_path):
        engine("crash")
        run = RunDirectory(tmp_path / "run")
        with pytest.raises(RunError) as caught:
            run_case(case, run)
        assert not isinstance(caught.value, RunUnstableError)
        assert "diagnosis" not in run.read_state()


class TestEnergy:
    """The budget, item by item, against closed forms."""

    def test_of_two_spheres_that_fly(self, case):
        mass = 7000.0 * 4 / 3 * math.pi * 0.0015**3
        assert sum(energy_budget(case).items_j.values()) == pytest.approx(
            2 * mass * 0.005**2 / 2,
            rel=1e-6,  # beside them the floor for scenes at rest
        )

    def test_of_gravity_and_its_buoyancy(self):
        gravity = {"acceleration": [0.0, 0.0, -9.81], "buoyancy": True}
        fluid = {**FLUID, "density": 3500.0}
        items = energy_budget(case_of(COLLISION, {"gravity": gravity, "fluid": fluid})).items_j
        mass = 7000.0 * 4 / 3 * math.pi * 0.0015**3
        assert items["weight"] == pytest.approx(0.5 * 2 * mass * 9.81 * 0.01, rel=1e-12)

    def test_of_pressure_and_piston(self):
        case = case_of(INFILTRATION)
        items = energy_budget(case).items_j
        volume = case.population.particle_volume_m3
        assert items["pressure"] == pytest.approx(1.5 * 10.0 * volume * 0.05, rel=1e-12)
        force = case.piston_mass_kg * 2.143e-3
        assert items["piston"] == pytest.approx(force * 2.143e-3 * 1.0**2 / 2, rel=1e-12)

    def test_a_near_field_has_no_budget(self):
        near = {"near_field": {"force": 1e-6, "reach": 1e-4}}
        assert energy_budget(case_of(COLLISION, near)) is None

    def test_contacts_hold_the_energy_of_the_collision_that_made_them(self, case):
        body = Body(0.0015, 7000.0 * 4 / 3 * math.pi * 0.0015**3, 1.0e7, 0.25)
        overlap = largest_overlap_m(body, body, 0.01)
        places = np.array([[0.0, 0.0, 0.0], [0.003 - overlap, 0.0, 0.0]])
        held = elastic_energy_j(contacts_at(places, case), case)
        # The overlap is a difference of places 10^4 times larger: 5/2 of its rounding.
        assert held == pytest.approx(body.mass_kg / 2 * 0.01**2 / 2, rel=1e-9)
