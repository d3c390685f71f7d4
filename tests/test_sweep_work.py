"""Work on one run of a sweep: each ending, and how often the engine is launched for it."""

from __future__ import annotations

import json
import os
import platform
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from small_scenes import COLLISION, INFILTRATION, scene_of

from liggghts_driver.claim import claimed, read_claim
from liggghts_driver.engine.stop import Stop
from liggghts_driver.errors import PackingError
from liggghts_driver.identity import scene_hash
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.sweeps.task import Outcome, Task
from liggghts_driver.sweeps.work import failures, is_done, work_on

#: More tries than any test asks for: a loop without an end is cut here.
TOO_MANY = 8


class Runaway(BaseException):
    """A task was tried again and again."""


@pytest.fixture
def task(tmp_path):
    return Task("a point", lambda: scene_of(COLLISION), tmp_path / "points" / "0123456789abcdef")


@pytest.fixture
def launches(engine, binary, tmp_path, monkeypatch):
    """How often the engine was launched since the last look."""
    counter, path = tmp_path / "launches", tmp_path / "counting"
    path.write_text(
        "#!/bin/sh\n"
        f'case "$*" in *"-log none"*) ;; *) echo "$PWD" >> {counter} ;; esac\n'
        f'exec {binary} "$@"\n'
    )
    path.chmod(0o755)
    monkeypatch.setenv("LIGGGHTS_DRIVER_BINARY", str(path))

    def since() -> int:
        lines = counter.read_text().splitlines() if counter.exists() else []
        counter.unlink(missing_ok=True)
        return len(lines)

    return since


class Tries:
    """Counts tries, and ends a loop of them."""

    def __init__(self) -> None:
        self.count = 0

    def __call__(self, _case: object) -> None:
        self.count += 1
        if self.count > TOO_MANY:
            raise Runaway


def state_of(task: Task) -> dict[str, object]:
    return RunDirectory(task.folder).read_state()


def snapshot(folder: Path) -> dict[Path, int]:
    """When everything but the empty file for locks was written last."""
    found = (path for path in folder.rglob("*") if path.name != "claim.lock")
    return {path: path.stat().st_mtime_ns for path in found}


class TestDone:
    def test_a_task_is_done(self, launches, task):
        cases, steps = [], []
        assert work_on(task, on_case=cases.append, on_step=steps.append) == Outcome("done")
        assert launches() == 1
        assert is_done(task.folder)
        results = json.loads((task.folder / "results.json").read_text())
        assert results["verdict"] == "valid"
        assert len(cases) == 1
        assert steps[-1] == cases[0].time.steps
        # A report takes longer than a small run; it is written when somebody wants to read it.
        assert not (task.folder / "report.html").exists()

    def test_once_done_nothing_is_touched(self, launches, task):
        work_on(task)
        launches()
        before = snapshot(task.folder)

        def no_scene():
            raise AssertionError("its scene is not needed")

        again = work_on(replace(task, scene=no_scene), retries=3)
        assert again == Outcome("done", reused=True)
        assert launches() == 0
        assert snapshot(task.folder) == before

    def test_a_whole_run_without_results_is_only_analysed(self, launches, task):
        """Its worker ended between the two."""
        work_on(task)
        launches()
        before = (task.folder / "log.liggghts").stat().st_mtime_ns
        results = task.folder / "results.json"
        results.unlink()
        assert not is_done(task.folder)
        assert work_on(task) == Outcome("done")
        assert launches() == 0
        assert results.exists()
        assert (task.folder / "log.liggghts").stat().st_mtime_ns == before
        assert not list(task.folder.glob("attempt-*"))

    def test_the_ranks_are_those_of_the_task(self, launches, task, monkeypatch):
        monkeypatch.setenv("LIGGGHTS_DRIVER_LAUNCHER", "env RANKS={ranks}")  # one engine
        assert work_on(replace(task, ranks=3)).ending == "done"
        assert state_of(task)["ranks"] == 3
        assert "RANKS=3" in state_of(task)["command"]


class TestFailed:
    def test_without_retries_it_is_tried_once(self, engine, launches, task):
        engine("error")
        outcome = work_on(task, on_case=Tries())
        assert outcome.ending == "failed"
        assert outcome.reason.startswith("spheres left the engine's box")
        assert "\n" not in outcome.reason
        assert launches() == 1
        assert failures(task.folder) == state_of(task)["failures"] == 1

    @pytest.mark.parametrize(
        "retries",
        [
            1,
            pytest.param(3),
        ],
    )
    def test_it_is_tried_again_as_often_as_asked(self, engine, launches, task, retries):
        engine("crash")
        tries = Tries()
        outcome = work_on(task, retries, on_case=tries)
        assert outcome.ending == "failed"
        assert launches() == tries.count == 1 + retries
        assert failures(task.folder) == 1 + retries
        assert len(list(task.folder.glob("attempt-*"))) == retries

    def test_what_would_go_the_same_way_is_not_tried_again(self, engine, launches, task):
        engine("error")
        tries = Tries()
        first = work_on(task, 3, on_case=tries)
        assert first.ending == "failed"
        assert launches() == tries.count == failures(task.folder) == 1
        before = state_of(task)
        assert work_on(task, 3, on_case=tries) == first
        assert launches() == 0
        assert state_of(task) == before

    def test_afterwards_it_is_left_alone_for_the_same_reason(self, engine, launches, task):
        engine("error")
        first = work_on(task, on_case=Tries())
        before = snapshot(task.folder)
        launches()
        again = work_on(task, on_case=Tries())
        assert again.ending == "failed"
        assert not again.reused
        assert again.reason
        assert again.reason in first.reason
        assert launches() == 0
        assert snapshot(task.folder) == before

    def test_failures_of_the_past_count(self, engine, launches, task):
        engine("crash")
        work_on(task, on_case=Tries())
        launches()
        work_on(task, retries=2, on_case=Tries())
        assert launches() == 2
        assert failures(task.folder) == 3

    def test_a_second_try_may_be_good(self, engine, launches, task):
        engine("crash")
        tries = []

        def on_case(_case: object) -> None:
            tries.append(1)
            if len(tries) == 2:
                engine("")

        assert work_on(task, 1, on_case=on_case) == Outcome("done")
        assert launches() == 2
        assert is_done(task.folder)
        assert failures(task.folder) == 1

    def test_what_cannot_be_placed_is_recorded_with_its_reason(self, launches, task):
        crowded = scene_of(INFILTRATION, {"particles.count": 600})
        outcome = work_on(replace(task, scene=lambda: crowded))
        assert outcome.ending == "failed"
        assert outcome.reason
        assert launches() == 0
        state = state_of(task)
        assert (state["state"], state["failures"]) == ("failed", 1)
        assert state["faults"] == [outcome.reason]
        assert scene_hash(RunDirectory(task.folder).read_scene()) == scene_hash(crowded)
        assert read_claim(RunDirectory(task.folder)) is None
        # It is told the same way without being tried.
        assert work_on(replace(task, scene=lambda: crowded)) == outcome

    def test_every_try_before_the_engine_counts_too(self, launches, task):
        made = []

        def crowded():
            made.append(1)
            assert len(made) <= TOO_MANY
            return scene_of(INFILTRATION, {"particles.count": 600})

        assert work_on(replace(task, scene=crowded), retries=2).ending == "failed"
        assert len(made) == 3
        assert failures(task.folder) == 3

    def test_a_folder_in_which_placing_failed_can_be_run_later(self, launches, task, monkeypatch):
        def fail(_scene: object):
            raise PackingError("no room\n  in many words")

        with monkeypatch.context() as patch:
            patch.setattr("liggghts_driver.solve.prepare", fail)
            assert work_on(task) == Outcome("failed", "no room")
        assert state_of(task)["faults"] == ["no room"]
        assert work_on(task, retries=1) == Outcome("done")
        assert launches() == 1
        assert is_done(task.folder)

    def test_an_engine_that_is_missing_is_no_failure_of_the_run(self, engine, task, monkeypatch):
        with monkeypatch.context() as patch:
            patch.setenv("LIGGGHTS_DRIVER_BINARY", "/no/such/engine")
            outcome = work_on(task)
        assert outcome.ending == "failed"
        assert "/no/such/engine" in outcome.reason
        assert failures(task.folder) == 0
        assert work_on(task) == Outcome("done")


class TestRefused:
    """What is in the folder is not the task's to change."""

    @pytest.mark.parametrize("found", ["files of a user", "another scene", "another version"])
    def test_a_folder_that_is_refused_stays_as_it_is(self, launches, task, found):
        if found == "files of a user":
            task.folder.mkdir(parents=True)
            (task.folder / "thesis.tex").write_text("precious")
        else:
            other = scene_of(COLLISION, {"seed": 2} if found == "another scene" else {})
            assert work_on(replace(task, scene=lambda: other)).ending == "done"
            (task.folder / "results.json").unlink()
        if found == "another version":
            deck = task.folder / "deck.in"
            deck.write_text(deck.read_text().replace("hertz", "hooke"))
        launches()
        before = snapshot(task.folder)
        outcome = work_on(task, retries=2)
        assert outcome.ending == "failed"
        assert "choose another folder" in outcome.reason
        assert launches() == 0
        assert snapshot(task.folder) == before


class TestInterrupted:
    def test_it_ends_at_a_checkpoint_and_goes_on(self, engine, launches, task):
        engine("slow")
        stop = Stop()

        def on_step(step: int) -> None:
            if step and not stop.asked:
                stop.ask()

        outcome = work_on(task, 3, stop, on_step=on_step)
        assert outcome.ending == "interrupted"
        assert str(task.folder) in outcome.reason
        assert launches() == 1
        assert state_of(task)["state"] == "interrupted"
        assert failures(task.folder) == 0
        assert work_on(task) == Outcome("done")
        assert launches() == 1
        assert state_of(task)["continuations"] == 1


class TestBusy:
    @pytest.fixture
    def another(self):
        """The claim of another process that lives."""
        process = subprocess.Popen(["sleep", "60"])
        stat = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
        yield {"host": platform.node(), "pid": process.pid, "started": int(stat[19])}
        process.kill()
        process.wait()

    @pytest.mark.parametrize(
        "found",
        [
            "its scene",
            pytest.param("no scene yet"),
        ],
    )
    def test_a_run_that_another_process_works_on_is_left_to_it(
        self, launches, task, another, found
    ):
        """The other one may have come so far that its scene is there, or not."""
        run = RunDirectory(task.folder)
        task.folder.mkdir(parents=True)
        run.claim.write_text(json.dumps(another))
        if found == "its scene":
            run.write_scene(scene_of(COLLISION))
        before = snapshot(task.folder)
        outcome = work_on(task, retries=2)
        assert outcome.ending == "busy"
        assert f"process {another['pid']}" in outcome.reason
        assert launches() == 0
        assert snapshot(task.folder) == before
        assert failures(task.folder) == 0

    def test_a_worker_that_died_before_it_wrote_anything_blocks_nobody(
        self, launches, task, another
    ):
        task.folder.mkdir(parents=True)
        gone = another | {"started": another["started"] - 1}
        RunDirectory(task.folder).claim.write_text(json.dumps(gone))
        assert work_on(task) == Outcome("done")
        assert launches() == 1

    def test_a_claim_of_this_process_counts(self, launches, task):
        """As when two sweeps go on in one program."""
        run = RunDirectory(task.folder)
        run.write_scene(scene_of(COLLISION))
        with claimed(run):
            outcome = work_on(task)
        assert outcome.ending == "busy"
        assert f"process {os.getpid()}" in outcome.reason
        assert work_on(task).ending == "done"
        assert launches() == 1
