"""A run that is asked to end, killed, or told to make checkpoints: what goes on, and from where."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from liggghts_driver.engine.stop import Stop
from liggghts_driver.errors import RunError, RunInterrupted
from liggghts_driver.results.series import read_run_series
from liggghts_driver.results.thermo import read_logs
from liggghts_driver.run import run_case
from liggghts_driver.timestep import frame_steps

TESTS = Path(__file__).parent
#: Where the stand-in "slow" is asked to end: with half of a second or more still to go.
EARLY = 0.2


@pytest.fixture
def patient(engine, binary, tmp_path, monkeypatch):
    """A stand-in that does not start before it is asked for a checkpoint."""
    path = tmp_path / "patient"
    path.write_text(
        "#!/bin/sh\n"
        'case "$*" in\n*"-log none"*) ;;\n'
        "*) until cmp -s control.in checkpoint.in; do sleep 0.02; done ;;\nesac\n"
        f'exec {binary} "$@"\n'
    )
    path.chmod(0o755)
    monkeypatch.setenv("LIGGGHTS_DRIVER_BINARY", str(path))
    return engine


def interrupt(case, run, share: float = EARLY) -> str:
    """Ask a run to end when such a share of it is done; what it then says."""
    stop = Stop()

    def on_step(step: int) -> None:
        if step >= share * case.time.steps and not stop.asked:
            stop.ask()

    with pytest.raises(RunInterrupted) as caught:
        run_case(case, run, on_step=on_step, stop=stop)
    return str(caught.value)


def assert_whole(case, run) -> None:
    """Every row and every frame is there, once and in order; nothing is kept for a continuation."""
    every, end = case.time.sample_every, case.time.steps
    assert run.read_state()["state"] == "complete"
    assert read_run_series(run)["step"].tolist() == list(range(every, end + 1, every))
    assert read_logs(run).rows["Step"].tolist() == list(range(0, end + 1, every))
    frames = [int(path.name.split(".")[1]) for path in run.frame_files()]
    assert frames == frame_steps(case.time)
    assert restart_files(run) == []


def restart_files(run) -> list[str]:
    """Those with which the run could go on; what was set aside stays as it was."""
    found = [path.relative_to(run.path) for path in run.path.rglob("*.restart")]
    return [str(path) for path in found if not path.parts[0].startswith("attempt-")]


def children(pid: int) -> list[int]:
    """Processes that a process has started and that are still there."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            state, parent = path.read_text().rpartition(")")[2].split()[:2]
            if int(parent) == pid and state != "Z":
                found.append(int(path.parent.name))
    return found


def alive(pid: int) -> bool:
    try:
        return "\nState:\tZ" not in Path(f"/proc/{pid}/status").read_text()
    except FileNotFoundError:
        return False


def wait_for(condition, seconds: float = 15.0):
    """What the condition gives, as soon as that is something."""
    end = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < end, "waited too long"
        time.sleep(0.02)
    return found


class TestAskedToEnd:
    def test_it_ends_at_a_checkpoint_and_says_how_to_go_on(self, engine, case, run):
        engine("slow")
        text = interrupt(case, run)
        assert str(run.path) in text
        assert "the same command goes on" in text
        state = run.read_state()
        assert (state["state"], state["continuations"], state["failures"]) == ("interrupted", 1, 0)
        (checkpoint,) = run.checkpoints()
        assert EARLY * case.time.steps <= checkpoint["step"] < case.time.steps
        assert f"interrupted at {checkpoint['step'] * case.time.step_s:.4g} of 0.1 s" in text
        assert restart_files(run) == [f"segments/1/restart/step.{checkpoint['step']}.restart"]
        assert not run.claim.exists()

    def test_the_next_one_goes_on_from_there(self, engine, case, run):
        engine("slow")
        interrupt(case, run)
        (checkpoint,) = run.checkpoints()
        engine("")
        steps: list[int] = []
        finished = run_case(case, run, on_step=steps.append)
        assert min(steps) == checkpoint["step"]
        assert_whole(case, run)
        assert not finished.reused
        assert finished.thermo.rows.equals(read_logs(run).rows)
        state = run.read_state()
        assert (state["continuations"], state["failures"]) == (1, 0)
        assert not list(run.path.glob("attempt-*"))
        # Both launches count.
        assert checkpoint["wall_s"] < finished.wall_s
        assert checkpoint["cpu_s"] < finished.cpu_s
        again = run_case(case, run)
        assert again.reused
        assert (again.wall_s, again.cpu_s) == (finished.wall_s, finished.cpu_s)

    def test_it_may_be_asked_again_and_again(self, engine, case, run):
        engine("slow")
        done = [0]
        for number, share in enumerate((0.1, 0.3, 0.55), start=1):
            interrupt(case, run, share)
            assert run.read_state()["continuations"] == number
            done.append(run.checkpoints()[-1]["step"])
            # A checkpoint is all that is needed; those before it would only take space.
            assert restart_files(run) == [f"segments/{number}/restart/step.{done[-1]}.restart"]
        assert done == sorted(set(done))
        engine("")
        run_case(case, run)
        assert_whole(case, run)
        assert (run.read_state()["continuations"], run.read_state()["failures"]) == (3, 0)
        assert [part.path.name for part in run.segments()] == ["1", "2", "3"]

    def test_asked_before_it_starts_it_still_makes_a_checkpoint(self, patient, case, run):
        stop = Stop()
        stop.ask()
        with pytest.raises(RunInterrupted):
            run_case(case, run, stop=stop)
        assert run.checkpoints()[0]["step"] == case.time.sample_every

    def test_without_a_restart_file_it_has_failed(self, patient, case, run):
        patient("no restart")
        stop = Stop()
        stop.ask()
        with pytest.raises(RunError, match=r"the engine wrote no step\.\d+\.restart"):
            run_case(case, run, stop=stop)
        state = run.read_state()
        assert (state["state"], state["failures"]) == ("failed", 1)
        assert "wrote no" in state["faults"][0]
        assert run.segments() == []
        # From the start, since there is nothing else to go on from.
        patient("")
        stop = Stop()
        stop.ask()
        with pytest.raises(RunInterrupted):
            run_case(case, run, stop=stop)
        assert (run.path / "attempt-1" / "run.json").exists()

    def test_when_waiting_has_an_end_the_engine_is_ended(self, engine, case, run):
        engine("hang")
        stop, pids = Stop(grace_s=0.3), run.path / "pids"

        def on_step(_: int) -> None:
            if pids.exists() and not stop.asked:
                stop.ask()

        with pytest.raises(KeyboardInterrupt) as caught:
            run_case(case, run, on_step=on_step, stop=stop)
        assert type(caught.value) is KeyboardInterrupt
        wait_for(lambda: not any(alive(int(pid)) for pid in pids.read_text().split()))
        assert run.read_state()["state"] == "interrupted"
        assert run.segments() == []
        engine("")
        run_case(case, run)
        assert_whole(case, run)


class TestFromTimeToTime:
    def test_it_goes_on_by_itself(self, engine, case, run):
        engine("slow")
        # The stand-in takes a second in all.
        finished = run_case(case, run, stop=Stop(checkpoint_every_s=0.3))
        assert_whole(case, run)
        state = run.read_state()
        assert state["continuations"] == len(run.segments()) >= 1
        assert state["failures"] == 0
        assert finished.wall_s > sum(part["wall_s"] for part in run.checkpoints()) > 0.3

    def test_a_wish_to_end_comes_first(self, engine, case, run):
        engine("slow")
        stop = Stop(checkpoint_every_s=0.2)

        def on_step(step: int) -> None:
            if run.segments() and not stop.asked:
                stop.ask()

        with pytest.raises(RunInterrupted):
            run_case(case, run, on_step=on_step, stop=stop)
        assert len(run.segments()) == 2


class TestFailures:
    def test_what_fails_after_a_checkpoint_is_tried_again_from_it(self, engine, case, run):
        engine("slow")
        interrupt(case, run)
        checkpoints = run.checkpoints()
        engine("crash")
        with pytest.raises(RunError):
            run_case(case, run)
        state = run.read_state()
        assert (state["state"], state["failures"], state["continuations"]) == ("failed", 1, 1)
        assert run.checkpoints() == checkpoints
        engine("")
        steps: list[int] = []
        run_case(case, run, on_step=steps.append)
        assert min(steps) == checkpoints[0]["step"]
        assert_whole(case, run)
        attempt = run.path / "attempt-1"
        assert json.loads((attempt / "run.json").read_text())["state"] == "failed"
        assert not (attempt / "segments").exists()
        assert not (run.path / "attempt-2").exists()
        assert run.read_state()["continuations"] == 1

    @pytest.mark.parametrize("after", ["the start", "a checkpoint"])
    def test_failures_are_counted_over_all_tries(self, engine, case, run, after):
        if after == "a checkpoint":
            engine("slow")
            interrupt(case, run)
        engine("crash")
        for number in (1, 2, 3):
            with pytest.raises(RunError):
                run_case(case, run)
            assert run.read_state()["failures"] == number
        engine("")
        run_case(case, run)
        assert run.read_state()["failures"] == 3

    def test_a_start_that_this_version_would_not_make_is_set_aside(self, engine, case, run):
        engine("slow")
        interrupt(case, run)
        deck = run.segments()[0].deck
        deck.write_text(deck.read_text().replace("hertz", "hooke"))
        edited = deck.read_text()
        engine("")
        run_case(case, run)
        assert_whole(case, run)
        assert run.segments() == []
        attempt = run.path / "attempt-1"
        assert (attempt / "segments" / "1" / "deck.in").read_text() == edited
        assert json.loads((attempt / "run.json").read_text())["state"] == "interrupted"
        assert run.read_state()["continuations"] == 0

    @pytest.mark.parametrize("words", ["# another title\n", "\n   \n"])
    def test_comments_and_blanks_make_no_other_deck(self, engine, case, run, words):
        engine("slow")
        interrupt(case, run)
        deck = run.segments()[0].deck
        deck.write_text(words + deck.read_text())
        engine("")
        run_case(case, run)
        assert_whole(case, run)
        assert run.read_state()["continuations"] == 1


class TestHalfMadeSegments:
    """As when the machine stops between the first file that is moved and the last."""

    def test_the_first_one(self, engine, case, run):
        engine("slow")
        interrupt(case, run)
        half_made = run.segments()[0].path
        (half_made / "checkpoint.json").unlink()
        half_made.rename(half_made.with_name(".1"))
        engine("")
        steps: list[int] = []
        run_case(case, run, on_step=steps.append)
        assert min(steps) == 0
        assert_whole(case, run)
        assert (run.path / "attempt-1" / ".1" / "deck.in").exists()
        assert list((run.path / "segments").iterdir()) == []

    @pytest.mark.parametrize(
        "left",
        [
            pytest.param("nothing"),
            "the deck",
        ],
    )
    def test_a_later_one(self, engine, case, run, left):
        engine("slow")
        interrupt(case, run, 0.1)
        first = run.segments()[0]
        shutil.copytree(first.restarts, run.path.parent / "kept")
        interrupt(case, run, 0.3)
        shutil.copytree(run.path.parent / "kept", first.restarts)
        half_made = run.path / "segments" / ".2"
        run.segments()[1].path.rename(half_made)
        (half_made / "checkpoint.json").unlink()
        if left == "the deck":
            (half_made / "deck.in").rename(run.deck)
        interrupt(case, run, 0.5)
        engine("")
        run_case(case, run)
        assert_whole(case, run)
        assert sorted(path.name for path in (run.path / "segments").iterdir()) == ["1", "2"]
        assert (run.path / "attempt-1" / ".2" / "log.liggghts").exists()


PROGRAM = """
import sys
from pathlib import Path
from liggghts_driver.engine.stop import Stop
from liggghts_driver.errors import RunInterrupted
from liggghts_driver.run import run_case
from liggghts_driver.rundir import RunDirectory
sys.path.insert(0, {tests!r})
from small_scenes import COLLISION, case_of
try:
    run_case(case_of(COLLISION), RunDirectory(Path({folder!r})), stop=Stop(grace_s=60.0))
except RunInterrupted as interrupted:
    print(interrupted)
    sys.exit(7)
except KeyboardInterrupt:
    sys.exit(8)
"""


@contextlib.contextmanager
def driver(run):
    """A process that runs the case; neither it nor its engine outlives the block."""
    text = PROGRAM.format(tests=str(TESTS), folder=str(run.path))
    process = subprocess.Popen(
        [sys.executable, "-c", text], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        yield process
    finally:
        pids = run.path / "pids"
        started = [int(pid) for pid in pids.read_text().split()] if pids.exists() else []
        for pid in [*started, *children(process.pid)]:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        process.kill()
        process.communicate(timeout=10)


def hanging(run) -> list[int]:
    """The hanging engine and what it started, as soon as they are there."""
    pids = run.path / "pids"
    wait_for(lambda: pids.exists() and len(pids.read_text().split()) == 2)
    return [int(pid) for pid in pids.read_text().split()]


class TestSignals:
    @pytest.mark.parametrize(
        ("name", "to_the_engine_too"),
        [("SIGINT", False), ("SIGTERM", True), ("SIGHUP", True), ("SIGUSR1", True)],
    )
    def test_a_signal_leads_to_a_checkpoint(self, engine, case, run, name, to_the_engine_too):
        """A batch system sends its signals to every process of a job."""
        engine("slow")
        with driver(run) as process:
            number = signal.Signals[name]
            wait_for(lambda: run.log.exists() and run.log.read_text().count("Loop time") >= 2)
            (program,) = children(process.pid)
            process.send_signal(number)
            if to_the_engine_too:
                os.kill(program, number)
            out, err = process.communicate(timeout=15)
            assert (process.returncode, err) == (7, "")
            assert "the same command goes on" in out
            assert not alive(program)
        assert run.read_state()["state"] == "interrupted"
        assert len(run.checkpoints()) == 1
        engine("")
        run_case(case, run)
        assert_whole(case, run)
        assert run.read_state()["continuations"] == 1

    def test_a_second_one_ends_a_hanging_engine_at_once(self, engine, run):
        engine("hang")
        with driver(run) as process:
            engine_and_child = hanging(run)
            process.send_signal(signal.SIGTERM)
            wait_for(lambda: run.control.read_text() == run.checkpoint_commands.read_text())
            time.sleep(0.3)
            assert process.poll() is None  # it still waits for the checkpoint
            assert all(map(alive, engine_and_child))
            process.send_signal(signal.SIGTERM)
            process.communicate(timeout=10)  # of 60 s that it would have waited
            assert process.returncode == 8
            wait_for(lambda: not any(map(alive, engine_and_child)), seconds=1.0)
        assert run.read_state()["state"] == "interrupted"

    def test_a_driver_that_is_killed_takes_the_engine_with_it(self, engine, case, run):
        engine("hang")
        with driver(run) as process:
            program, _ = hanging(run)
            process.kill()
            process.wait(10)
            # Of 300 s that the engine would have gone on.
            wait_for(lambda: not alive(program), seconds=5.0)
        assert run.read_state()["state"] == "running"  # nobody was left to tell
        assert run.claim.exists()
        engine("")
        run_case(case, run)
        assert_whole(case, run)
