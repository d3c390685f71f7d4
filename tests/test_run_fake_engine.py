"""Every way in which the engine can fail, by a stand-in: named rightly, and never believed."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from small_scenes import COLLISION, FLUID, case_of, scene_of

from liggghts_driver.deck.build import build_deck
from liggghts_driver.errors import RunError, RunFolderError
from liggghts_driver.identity import scene_hash
from liggghts_driver.run import run_case

if TYPE_CHECKING:
    from liggghts_driver.rundir import RunDirectory

TESTS = Path(__file__).parent


@pytest.fixture
def behave(binary, monkeypatch):
    """Choose how the stand-in behaves."""
    monkeypatch.setenv("LIGGGHTS_DRIVER_BINARY", str(binary))

    def choose(behaviour: str) -> None:
        monkeypatch.setenv("FAKE_ENGINE", behaviour)

    choose("")
    return choose


def failure(case, run) -> str:
    """The message of a failed run; the state on disk must say so too."""
    with pytest.raises(RunError) as caught:
        run_case(case, run)
    state = run.read_state()
    assert state["state"] == "failed"
    assert state["faults"]
    text = str(caught.value)
    assert str(run.path) in text
    assert run.deck.exists()
    return text


def test_a_whole_run(behave, case, run):
    finished = run_case(case, run)
    assert not finished.reused
    assert finished.engine == "LIGGGHTS-PUBLIC 3.8.0-fake"
    assert finished.thermo.rows["Step"].iloc[-1] == case.time.steps
    state = run.read_state()
    assert state["state"] == "complete"
    assert state["scene_hash"] == scene_hash(case.scene)
    assert state["returncode"] == 0
    assert state["wall_s"] > 0
    assert state["command"][-5:] == ["deck.in", "-log", "log.liggghts", "-echo", "both"]
    # The deck on disk is that of the case.
    assert run.deck.read_text() == build_deck(case, scene_hash(case.scene)).files["deck.in"]
    assert run.read_scene() == case.scene


def test_every_row_of_the_series_is_reported_as_it_comes(behave, case, run):
    steps: list[int] = []
    finished = run_case(case, run, on_step=steps.append)
    assert steps == finished.thermo.rows["Step"].tolist()


def test_a_finished_run_is_not_run_again(behave, case, run):
    run_case(case, run)
    before = {path: path.stat().st_mtime_ns for path in run.path.rglob("*")}
    behave("silent")  # whoever ran the engine now would fail
    again = run_case(case, run)
    assert again.reused
    assert again.thermo.rows["Step"].iloc[-1] == case.time.steps
    assert {path: path.stat().st_mtime_ns for path in run.path.rglob("*")} == before


@pytest.mark.parametrize(
    "behaviour",
    [
        "empty log",
        pytest.param("silent"),
    ],
)
def test_an_end_without_a_word(behave, case, run, behaviour):
    behave(behaviour)
    text = failure(case, run)
    assert "return code 1" in text
    assert "no row of the series" in text


def test_a_command_that_the_engine_refuses(behave, case, run):
    behave("bad command")
    text = failure(case, run)
    assert "the engine says: ERROR: Invalid pair style (../force.cpp:123)" in text
    number, line = next(
        (n, line)
        for n, line in enumerate(run.deck.read_text().splitlines(), start=1)
        if line.startswith("pair_style")
    )
    assert f"at deck.in, line {number}: {line.strip()}" in text
    assert "return code 1" in text
    assert "did not reach the end of the deck" in text


def line_of(deck: Path, word: str) -> int:
    lines = deck.read_text().splitlines()
    return max(n for n, line in enumerate(lines, start=1) if line.startswith(word))


def test_an_error_in_the_middle_of_the_run(behave, case, run):
    behave("error")
    text = failure(case, run)
    assert "ERROR on proc 0: Atom lost" in text
    assert f"at pieces.in, line {line_of(run.pieces, 'run')}: run" in text
    assert "its last lines:" in text
    assert "stopped at step" in text


def test_an_error_in_the_middle_of_a_run_with_refreshed_drag(behave, run):
    behave("error")
    text = failure(case_of(COLLISION, {"fluid": FLUID, "drag.refresh": 0.001}), run)
    assert f"at pieces.in, line {line_of(run.pieces, 'run')}: run" in text


def test_a_segmentation_fault(behave, case, run):
    behave("crash")
    text = failure(case, run)
    assert f"return code {-signal.SIGSEGV}" in text or "return code 139" in text
    assert "stopped at step" in text


def test_a_normal_end_too_early(behave, case, run):
    """As after SIGTERM: return code 0 and a usual last line."""
    behave("early")
    text = failure(case, run)
    assert f"of {case.time.steps}" in text
    assert "did not reach the end of the deck" in text
    assert "return code" not in text
    assert "Loop time" in run.stdout.read_text()


def test_the_echo_of_the_sentinel_is_not_the_sentinel(behave, case, run):
    behave("unfinished")
    text = failure(case, run)
    assert "the run failed: the engine did not reach the end of the deck\n" in text
    assert "complete" in run.stdout.read_text()


def test_a_bad_end_after_everything(behave, case, run):
    behave("return code 3")
    assert "the run failed: the engine ended with return code 3\n" in failure(case, run)


def test_lost_spheres(behave, case, run):
    behave("lost")
    text = failure(case, run)
    assert "1 of 2 spheres were lost by step" in text
    step = int(text.split("lost by step ")[1].split()[0])
    assert step == pytest.approx(case.time.steps / 2, abs=case.time.sample_every)


def test_the_last_frame_is_missing(behave, case, run):
    behave("no last frame")
    assert f"the frame of step {case.time.steps} is not there" in failure(case, run)


@pytest.mark.parametrize("behaviour", ["cut frame", "empty frame"])
def test_the_last_frame_is_cut_off(behave, case, run, behaviour):
    """As on a full disk."""
    behave(behaviour)
    assert "frame" in failure(case, run)


def test_the_series_is_cut_off(behave, case, run):
    behave("short series")
    assert "series" in failure(case, run)


def test_garbage_is_no_problem_by_itself(behave, case, run):
    behave("garbage")
    assert run_case(case, run).thermo.rows["Step"].iloc[-1] == case.time.steps


@pytest.mark.parametrize("behaviour", ["bad command", "crash", "early", "lost"])
def test_a_failed_run_is_tried_anew_and_kept_aside(behave, case, run, behaviour):
    behave(behaviour)
    failure(case, run)
    failed = run.stdout.read_bytes()
    behave("")
    assert not run_case(case, run).reused
    assert (run.path / "attempt-1" / "stdout.log").read_bytes() == failed
    assert json.loads((run.path / "attempt-1" / "run.json").read_text())["state"] == "failed"
    assert run.read_state()["state"] == "complete"
    # Nothing of the first attempt is taken for the second's.
    assert len(run.frame_files()) == case.time.steps // case.time.frame_every + 1


def test_two_attempts_are_both_kept(behave, case, run):
    behave("crash")
    for _ in range(3):
        failure(case, run)
    assert {path.name for path in run.path.glob("attempt-*")} == {"attempt-1", "attempt-2"}


def test_another_scenes_folder_is_refused_before_the_engine_is_asked(behave, case, run):
    run_case(case, run)
    before = sorted(run.path.rglob("*"))
    with pytest.raises(RunFolderError, match="another scene"):
        run_case(case_of(COLLISION, {"seed": 2}), run)
    assert sorted(run.path.rglob("*")) == before


def test_another_title_is_no_other_scene(behave, case, run):
    run_case(case, run)
    assert run_case(case_of(COLLISION, {"title": "named"}), run).reused


def test_a_finished_run_of_another_deck_is_not_reused(behave, case, run):
    """After a change of templates or package, the deck of the same scene may be another."""
    run_case(case, run)
    run.deck.write_text(run.deck.read_text().replace("hertz", "hooke"))
    with pytest.raises(RunFolderError):
        run_case(case, run)


@pytest.mark.parametrize("name", ["particles.data"])
def test_a_finished_run_of_other_particles_is_not_reused(behave, case, run, name):
    """After a change of the packing the same scene may have other particles."""
    run_case(case, run)
    path = run.path / name
    path.write_text(path.read_text().replace("0.0016", "0.0017"))
    with pytest.raises(RunFolderError):
        run_case(case, run)


def test_a_finished_run_without_its_deck_is_not_reused(behave, case, run):
    run_case(case, run)
    run.deck.unlink()
    with pytest.raises(RunFolderError):
        run_case(case, run)


def test_a_fault_of_the_caller_does_not_block_the_folder(behave, case, run):
    """As in a notebook: its own callback fails, and the process lives on."""

    def fail(_: int) -> None:
        raise RuntimeError("in a callback")

    with pytest.raises(RuntimeError, match="callback"):
        run_case(case, run, on_step=fail)
    assert run.read_state()["state"] != "running"
    assert not run_case(case, run).reused


def alive(pid: int) -> bool:
    try:
        return "\nState:\tZ" not in Path(f"/proc/{pid}/status").read_text()
    except FileNotFoundError:
        return False


def wait_for(condition, seconds: float = 10.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited too long"
        time.sleep(0.02)


@pytest.mark.parametrize("behaviour", ["hang", "stubborn"])
def test_an_interrupt_ends_the_engine_and_all_that_it_started(
    behave, case, run, behaviour, monkeypatch
):
    behave(behaviour)
    monkeypatch.setattr("liggghts_driver.engine.launch._GRACE_S", 0.2)
    pids = run.path / "pids"

    def interrupt(_: int) -> None:
        if pids.exists():
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_case(case, run, on_step=interrupt)
    assert run.read_state()["state"] == "interrupted"
    wait_for(lambda: not any(alive(int(pid)) for pid in pids.read_text().split()))
    # What there is stays, and the next attempt starts anew.
    behave("")
    assert not run_case(case, run).reused
    assert json.loads((run.path / "attempt-1" / "run.json").read_text())["state"] == "interrupted"


PROGRAM = """
import sys
from pathlib import Path
from liggghts_driver.engine.stop import Stop
from liggghts_driver.run import run_case
from liggghts_driver.rundir import RunDirectory
sys.path.insert(0, {tests!r})
from small_scenes import COLLISION, case_of
run_case(case_of(COLLISION), RunDirectory(Path({folder!r})), stop=Stop(grace_s=0.3))
"""


def driver(run: RunDirectory) -> subprocess.Popen:
    text = PROGRAM.format(tests=str(TESTS), folder=str(run.path))
    return subprocess.Popen([sys.executable, "-c", text], stderr=subprocess.PIPE)


@pytest.mark.parametrize(
    "number",
    [
        signal.SIGINT,
        signal.SIGTERM,
        pytest.param(signal.SIGHUP),
    ],
)
def test_a_signal_to_the_driver_leaves_no_process_behind(behave, run, number):
    behave("hang")
    process = driver(run)
    pids = run.path / "pids"
    wait_for(lambda: pids.exists() and len(pids.read_text().split()) == 2)
    engine = [int(pid) for pid in pids.read_text().split()]
    try:
        process.send_signal(number)
        process.communicate(timeout=10)
        wait_for(lambda: not any(map(alive, engine)), seconds=1.0)
        assert run.read_state()["state"] == "interrupted"
    finally:
        for pid in filter(alive, engine):
            os.kill(pid, signal.SIGKILL)


def test_a_folder_in_which_a_run_is_going_on_is_refused(behave, case, run):
    behave("hang")
    process = driver(run)
    pids = run.path / "pids"
    wait_for(pids.exists)
    try:
        behave("")
        with pytest.raises(RunFolderError):
            run_case(case, run)
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=10)


@pytest.mark.parametrize(
    "behaviour",
    [
        pytest.param("flood"),
        pytest.param("one long line"),
    ],
)
def test_a_flood_of_output_costs_neither_memory_nor_much_time(behave, run, behaviour):
    behave(behaviour)
    start = time.monotonic()
    process = driver(run)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.stderr.read() == b""
    process.stderr.close()
    assert process.returncode == 0
    assert run.stdout.stat().st_size > 99_000_000
    # Ten times what it takes on a slow machine.
    assert time.monotonic() - start < 20
    # A child begins as a fork of this process; 100 MB of output kept would show beside that.
    own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert (usage.ru_maxrss - own) * 1024 < 50e6


def test_the_scene_of_a_run_can_be_read_again(behave, case, run):
    run_case(case, run)
    assert scene_hash(run.read_scene()) == scene_hash(scene_of(COLLISION))
