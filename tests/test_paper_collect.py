"""The paper's results as they are stored: from run folders, thinned, with what made them."""

from __future__ import annotations

import json
import platform
from dataclasses import replace

import pandas as pd
import pytest
from paper_results import answer, only, point, power_law, shipped

from liggghts_driver.identity import scene_hash
from liggghts_driver.machine import this_machine
from liggghts_driver.paper import collect as collecting
from liggghts_driver.paper.catalogue import SWEEPS, sweep_file
from liggghts_driver.paper.collect import collect, collect_points
from liggghts_driver.paper.decks import deck_sha256_in, files_sha256
from liggghts_driver.paper.stored import (
    Stored,
    SweepResults,
    from_text,
    read_stored,
    to_text,
    write_stored,
)
from liggghts_driver.paper.tasks import tasks_to_do
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.sweeps.plan import make_plan, read_plan, write_plan

DECK = {"deck.in": "units si  # a comment\ntimestep 5e-4\n", "particles.data": "1 0.001 2.5\n"}


@pytest.fixture(scope="module")
def plan():
    return make_plan(sweep_file("exit"))  # the smallest: three packings


def finish(folder, **changes):
    """Write what a finished run leaves: a constant flow from 10 s on, half past the middle."""
    run = RunDirectory(folder)
    run.path.mkdir(parents=True)
    part = {"mean": 2.0000001e-6, "ci95": 1e-7, "steady": False}
    part |= {"steady_from_s": 25.0, "reason": "drifts: a lot"}
    results = {
        "verdict": "not_steady",
        "reasons": ["entrance: drifts"],
        "sections": {
            "entrance": {"particle_flow_rate_m3_s": part},
            "middle": {"particle_flow_rate_m3_s": {**part, "mean": 1e-6, "steady": True}},
        },
        "flowing_velocity_m_s": {**part, "mean": 2e-3},
        "time_step_s": 5e-4,
        "cost": {"wall_s": 90.0, "cpu_s": 80.0, "steps": 100_000, "particles": 9, "ranks": 1},
        "provenance": {"engine": "LIGGGHTS-PUBLIC 3.8.0", "liggghts_driver": "0.1.0"},
        **changes,
    }
    run.results.write_text(json.dumps(results), encoding="utf-8")
    time = pd.Series(range(501)) * 0.1
    volume = 2e-6 * (time - 10.0).clip(lower=0.0)
    series = pd.DataFrame(
        {
            "time_s": time,
            "inside": 7,
            "flowing": 5,
            "piston_x_m": -0.2 + 1e-3 * time,
            "volume_entrance_m3": volume,
            "volume_middle_m3": 0.5 * volume,
            "flowing_velocity_m_s": (1e-3 + 1e-5 * time).where(time >= 10.0),
        }
    )
    run.series.write_text(series.to_csv(index=False), encoding="utf-8")
    for name, text in DECK.items():
        (folder / name).write_text(text, encoding="utf-8")
    run.write_state(state="complete", host=platform.node(), started="2026-01-02T03:04:05+0000")


class TestAPoint:
    @pytest.fixture
    def found(self, plan, tmp_path):
        finish(tmp_path / plan.points[0].run)
        return collect_points(plan, tmp_path)[0]

    def test_it_is_known_by_its_scene_and_seed(self, found, plan):
        assert (found.state, found.why) == ("done", "")
        assert found.values == {"specimen.exit": "open"}  # noqa: PD011 - not those of a table
        assert (found.seed, found.replicate) == (1, 0)
        assert found.scene_sha256 == scene_hash(plan.scene(plan.points[0]))

    def test_numbers_are_those_of_the_run_to_six_digits(self, found):
        told = found.answer.flow_m3_s["entrance"]
        assert (told.mean, told.ci95, told.steady) == (2e-6, 1e-7, False)
        assert told.reason == "drifts: a lot"
        assert found.answer.flow_m3_s["middle"].steady
        assert found.answer.velocity_m_s.mean == 2e-3
        assert (found.answer.inside, found.answer.flowing) == (7, 5)

    def test_the_range_of_the_velocity_is_that_of_the_second_half(self, found):
        assert found.answer.velocity_range_m_s == pytest.approx((1.25e-3, 1.5e-3))

    def test_the_first_arrival(self, found):
        assert found.answer.reached_s == {"entrance": 10.1, "middle": 10.1}

    def test_curves_are_thinned_to_about_a_hundred_whole_numbers(self, found):
        curves = found.answer.curves
        assert curves.interval_s == 0.5
        assert len(curves.piston_x_um) == 101
        assert curves.piston_x_um[-1] == -150_000
        assert curves.volume_mm3["entrance"][-1] == 80_000
        assert curves.volume_mm3["middle"][20:22] == [0, 500]

    def test_costs_and_what_made_it(self, found):
        cost, made = found.answer.cost, found.answer.provenance
        assert (cost["cpu_s"], cost["simulated_s"], cost["step_s"]) == (80.0, 50.0, 5e-4)
        assert made["deck_sha256"] == files_sha256(DECK)
        assert made["machine"] == this_machine()
        assert made["started"].startswith("2026-01-02")

    def test_of_a_run_on_another_machine_nothing_is_told(self, plan, tmp_path):
        finish(tmp_path / plan.points[0].run)
        run = RunDirectory(tmp_path / plan.points[0].run)
        run.write_state(state="complete", host="another")
        assert collect_points(plan, tmp_path)[0].answer.provenance["machine"] is None

    def test_a_run_in_which_nothing_flows(self, plan, tmp_path):
        finish(tmp_path / plan.points[0].run, flowing_velocity_m_s={})
        series = RunDirectory(tmp_path / plan.points[0].run).series
        table = pd.read_csv(series).assign(flowing_velocity_m_s=float("nan"))
        table.to_csv(series, index=False)
        found = collect_points(plan, tmp_path)[0].answer
        assert found.velocity_m_s.mean is None
        assert found.velocity_range_m_s is None


class TestPointsWithoutAnAnswer:
    def test_they_are_there_with_the_reason(self, plan, tmp_path):
        first, second, third = plan.points
        failed = RunDirectory(tmp_path / first.run)
        failed.path.mkdir()
        failed.write_state(state="failed", faults=["Atom lost"])
        begun = RunDirectory(tmp_path / second.run)
        begun.path.mkdir()
        begun.write_state(state="interrupted")
        found = collect_points(plan, tmp_path)
        assert [p.state for p in found] == ["failed", "unfinished", "unfinished"]
        assert [p.why for p in found] == ["Atom lost", "not finished yet", "not run yet"]
        assert third.run == found[2].run

    def test_an_answer_that_cannot_be_read_is_a_failure(self, plan, tmp_path):
        finish(tmp_path / plan.points[0].run)
        RunDirectory(tmp_path / plan.points[0].run).series.unlink()
        found = collect_points(plan, tmp_path)[0]
        assert found.state == "failed"
        assert found.why.startswith("its answer cannot be read (FileNotFoundError")

    def test_an_invalid_one_is_kept_and_not_sound(self, plan, tmp_path):
        finish(tmp_path / plan.points[0].run, verdict="invalid", reasons=["too fast"])
        found = collect_points(plan, tmp_path)[0]
        assert found.answer.reasons == ["too fast"]
        assert found.sound is None


class TestWhatWasStoredBefore:
    def known(self, plan):
        planned = plan.points[0]
        hashed = scene_hash(plan.scene(planned))
        old = replace(point({}, 0, answer(3e-6)), run=planned.run, scene_sha256=hashed)
        return {hashed: old}

    def test_it_is_kept_where_its_run_is_not(self, plan, tmp_path):
        found = collect_points(plan, tmp_path, self.known(plan))
        assert found[0].answer.flow_m3_s["entrance"].mean == 3e-6
        assert found[1].answer is None

    def test_it_is_kept_until_its_run_is_finished_again(self, plan, tmp_path):
        (tmp_path / plan.points[0].run).mkdir()
        found = collect_points(plan, tmp_path, self.known(plan))
        assert found[0].answer.flow_m3_s["entrance"].mean == 3e-6

    def test_a_run_wins_over_it(self, plan, tmp_path):
        finish(tmp_path / plan.points[0].run)
        found = collect_points(plan, tmp_path, self.known(plan))
        assert found[0].answer.flow_m3_s["entrance"].mean == 2e-6

    def test_another_scene_is_not_it(self, plan, tmp_path):
        known = {"another": next(iter(self.known(plan).values()))}
        assert collect_points(plan, tmp_path, known)[0].answer is None


class TestTheFile:
    def test_it_comes_back_as_it_was(self, tmp_path):
        made = only("gradient", [point({"a": 1.5}, 0, answer(2e-6)), point({"a": "b"}, 1)])
        write_stored(made, tmp_path / "results.json")
        assert read_stored(tmp_path / "results.json") == made
        assert not read_stored(tmp_path / "none.json").sweeps

    def test_another_form_is_refused(self):
        with pytest.raises(ValueError, match="form 99"):
            from_text('{"form": 99, "sweeps": []}')

    def test_all_of_it_is_small(self):
        """Every point of every sweep with an answer: it is kept in the repository."""
        assert len(to_text(shipped(power_law(1.0))).encode()) < 500_000

    def test_every_sweep_is_in_it(self, tmp_path):
        found = collect(tmp_path)
        assert tuple(found.sweeps) == SWEEPS
        assert all(p.why == "not run yet" for p in found.points())
        assert found.sweeps["friction"].settings["contact.rolling_friction"] == 0.05


class TestDecks:
    def changed(self, name, text):
        return files_sha256({**DECK, name: text}) != files_sha256(DECK)

    def test_comments_and_what_is_not_the_answers_do_not_count(self):
        assert not self.changed("deck.in", "units si\n# another\n\ntimestep 5e-4\n")
        assert not self.changed("control.in", "jump")
        assert not self.changed("checkpoint.in", "restart")

    def test_rounding_does_not_count_and_a_change_does(self):
        assert not self.changed("particles.data", "1 0.00100000000001 2.5\n")
        assert self.changed("particles.data", "1 0.0010000001 2.5\n")
        assert self.changed("deck.in", "units si\ntimestep 4e-4\n")
        assert self.changed("pieces.in", "run 1\n")

    def test_a_run_that_went_on_is_known_by_the_deck_it_began_with(self, tmp_path):
        for folder, text in (("segments/1", DECK["deck.in"]), (".", "read_restart x\n")):
            (tmp_path / folder).mkdir(parents=True, exist_ok=True)
            (tmp_path / folder / "deck.in").write_text(text, encoding="utf-8")
        assert deck_sha256_in(RunDirectory(tmp_path)) == files_sha256({"deck.in": DECK["deck.in"]})


def test_the_processor_is_named(tmp_path):
    told = tmp_path / "cpuinfo"
    told.write_text("processor\t: 0\nmodel name\t: A made-up one\n", encoding="utf-8")
    assert this_machine(told)["cpu"] == "A made-up one"
    assert this_machine(tmp_path / "none")["cpu"] == (platform.processor() or platform.machine())


def test_what_is_done_is_not_run_again(plan, tmp_path):
    runs = tmp_path / "points"
    finish(runs / plan.points[1].run)
    tasks = tasks_to_do(["exit"], runs)
    assert [task.folder.name for task in tasks] == [plan.points[0].run, plan.points[2].run]
    assert tasks[0].name == "exit: specimen.exit = open, seed 1"
    assert len(read_plan(tmp_path / "sweep-exit").points) == 3


def test_first_packings_are_run_first(tmp_path):
    tasks = tasks_to_do(["exit", "grains"], tmp_path / "points")
    seeds = [task.name.rpartition(", ")[2] for task in tasks]
    assert len(set(seeds)) == 3
    assert seeds == [seed for seed in dict.fromkeys(seeds) for _ in range(3)]
    assert [task.name.partition(":")[0] for task in tasks[:3]] == ["exit", "grains", "grains"]


def test_what_is_stored_is_not_run_again(plan, tmp_path):
    elsewhere = tmp_path / "elsewhere"
    finish(elsewhere / plan.points[1].run)
    points = collect_points(plan, elsewhere)
    stored = Stored({"exit": SweepResults("exit", "An open exit", {}, points)})
    left = [task.folder.name for task in tasks_to_do(["exit"], tmp_path / "points", stored)]
    assert left == [plan.points[0].run, plan.points[2].run]
    assert len(tasks_to_do(["exit"], tmp_path / "points")) == 3


def test_plans_of_an_earlier_version_stay(tmp_path):
    """A sweep whose points are others now is planned beside what was planned before."""
    write_plan(make_plan(sweep_file("grains")), tmp_path / "sweep-exit")
    before = (tmp_path / "sweep-exit" / "sweep.json").read_bytes()
    assert len(tasks_to_do(["exit"], tmp_path / "points")) == 3
    assert (tmp_path / "sweep-exit" / "sweep.json").read_bytes() == before
    (kept,) = tmp_path.glob("sweep-exit-*")
    assert read_plan(kept).source == "exit.toml"


def test_collecting_reads_the_shipped_files(tmp_path, monkeypatch, plan):
    monkeypatch.setattr(collecting, "SWEEPS", ("exit",))
    finish(tmp_path / plan.points[2].run)
    found = collect(tmp_path)
    assert [p.state for p in found.points("exit")] == ["unfinished", "unfinished", "done"]
