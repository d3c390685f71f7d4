"""How a sweep stands, read from what lies in its run directories alone."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import time
from pathlib import Path

import pytest
from small_scenes import INFILTRATION

from liggghts_driver.rundir import RunDirectory
from liggghts_driver.sweeps.model import SlurmSettings
from liggghts_driver.sweeps.plan import Plan, Point, make_plan
from liggghts_driver.sweeps.status import STATES, RunState, points_by_state, run_states
from liggghts_driver.sweeps.tasks import to_do

#: The name of a run, as a plan makes it.
NAME = "0123456789abcdef"


@pytest.fixture(autouse=True)
def no_job(monkeypatch):
    """Not in a batch job, whatever these tests themselves run in."""
    for name in [name for name in os.environ if name.startswith("SLURM_")]:
        monkeypatch.delenv(name)


@pytest.fixture
def runs(tmp_path):
    return tmp_path / "points"


@pytest.fixture
def folder(runs):
    """The folder of one run."""
    run = RunDirectory(runs / NAME)
    run.path.mkdir(parents=True)
    return run


def never_asked(job: str) -> bool:
    raise AssertionError(f"asked for job {job}")


def state_of(runs: Path, queued: str | None = None, asks=never_asked) -> RunState:
    waits = {} if queued is None else {NAME: queued}
    return run_states([NAME], runs, waits, asks)[NAME]


def claim_of(pid: int, **others: object) -> dict[str, object]:
    stat = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return {"host": platform.node(), "pid": pid, "started": int(stat[19]), "job": None} | others


def alive_here() -> dict[str, object]:
    return claim_of(os.getpid())


def gone() -> dict[str, object]:
    """The claim of a process that has ended."""
    process = subprocess.Popen(["sleep", "60"])
    found = claim_of(process.pid)
    process.kill()
    process.wait()
    return found


def elsewhere(job: str | None) -> dict[str, object]:
    return claim_of(os.getpid(), host="elsewhere", job=job)


class TestStates:
    @pytest.mark.parametrize("there", [True, False])
    def test_waiting_with_nothing_there(self, runs, there):
        if there:
            (runs / NAME).mkdir(parents=True)
        assert state_of(runs) == RunState("waiting")

    def test_waiting_with_a_scene_alone(self, runs, folder):
        folder.scene.write_text("{}")
        assert state_of(runs) == RunState("waiting")

    def test_done(self, runs, folder):
        folder.write_state(state="complete", failures=1, continuations=2)
        folder.results.write_text('{\n  "verdict": "not_steady",\n  "reasons": []\n}')
        assert state_of(runs) == RunState("done", "", 1, 2, verdict="not_steady")

    def test_done_whatever_else_is_there(self, runs, folder):
        folder.write_state(state="complete", failures=0, continuations=0)
        folder.results.write_text("{}")
        folder.claim.write_text(json.dumps(gone()))
        assert state_of(runs, "job 12, pending") == RunState("done", verdict="unreadable")

    def test_whole_but_not_analysed(self, runs, folder):
        folder.write_state(state="complete", failures=0, continuations=3)
        assert state_of(runs) == RunState("waiting", "", 0, 3)

    def test_results_of_a_run_that_is_not_whole_are_none(self, runs, folder):
        folder.results.write_text("{}")
        folder.write_state(state="failed", faults=["lost"], failures=1)
        assert state_of(runs).state == "failed"

    def test_running(self, runs, folder):
        folder.claim.write_text(json.dumps(alive_here()))
        for _ in range(2):  # before and after the engine has started
            found = state_of(runs)
            assert found.state == "running"
            assert f"process {os.getpid()} on {platform.node()}" in found.reason
            folder.write_state(state="running", failures=0, continuations=0)

    @pytest.mark.parametrize("before", ["failed", "interrupted"])
    def test_running_again(self, runs, folder, before):
        folder.write_state(state=before, failures=1, continuations=1, faults=["lost"])
        folder.claim.write_text(json.dumps(alive_here()))
        found = state_of(runs)
        assert (found.state, found.failures, found.continuations) == ("running", 1, 1)

    def test_running_elsewhere(self, runs, folder):
        folder.claim.write_text(json.dumps(elsewhere(None)))
        assert state_of(runs).state == "running"

    @pytest.mark.parametrize(("runs_still", "state"), [(True, "running"), (False, "lost")])
    def test_of_a_job_elsewhere_the_batch_system_knows(self, runs, folder, runs_still, state):
        folder.write_state(state="running", failures=0, continuations=0)
        folder.claim.write_text(json.dumps(elsewhere("12_3")))
        found = state_of(runs, asks={"12_3": runs_still}.__getitem__)
        assert found.state == state
        assert "job 12_3" in found.reason

    def test_queued(self, runs):
        assert state_of(runs, "job 12_3, pending") == RunState("queued", "job 12_3, pending")

    @pytest.mark.parametrize("before", ["failed", "interrupted", "running"])
    def test_queued_again(self, runs, folder, before):
        folder.write_state(state=before, failures=1, continuations=2, faults=["lost"])
        found = state_of(runs, "job 12, pending")
        assert found == RunState("queued", "job 12, pending", 1, 2)

    def test_queued_with_a_dead_claim(self, runs, folder):
        folder.claim.write_text(json.dumps(gone()))
        assert state_of(runs, "job 12, pending").state == "queued"

    def test_running_although_its_job_still_has_points_in_the_queue(self, runs, folder):
        folder.claim.write_text(json.dumps(alive_here()))
        assert state_of(runs, "job 12, running").state == "running"

    def test_failed_and_why(self, runs, folder):
        folder.write_state(state="failed", failures=2, continuations=1, faults=["lost", "late"])
        assert state_of(runs) == RunState("failed", "lost", 2, 1)

    @pytest.mark.parametrize("faults", [{}, {"faults": []}, {"faults": None}, {"faults": "word"}])
    def test_failed_without_a_reason(self, runs, folder, faults):
        folder.write_state(state="failed", failures=1, **faults)
        found = state_of(runs)
        assert found.state == "failed"
        assert "no reason" in found.reason

    def test_failed_with_a_dead_claim(self, runs, folder):
        """What it said itself is worth more."""
        folder.write_state(state="failed", failures=1, faults=["lost"])
        folder.claim.write_text(json.dumps(gone()))
        assert state_of(runs) == RunState("failed", "lost", 1, 0)

    def test_a_reason_that_looks_like_a_state(self, runs, folder):
        fault = 'the engine said "state": "complete", "failures": 9'
        folder.write_state(state="failed", failures=1, continuations=0, faults=[fault])
        folder.results.write_text("{}")
        assert state_of(runs) == RunState("failed", fault, 1, 0)

    def test_interrupted(self, runs, folder):
        folder.write_state(state="interrupted", failures=0, continuations=4)
        found = state_of(runs)
        assert (found.state, found.continuations) == ("interrupted", 4)
        assert "checkpoint" in found.reason

    def test_lost_by_a_dead_claim_alone(self, runs, folder):
        claim = gone()
        folder.claim.write_text(json.dumps(claim))
        found = state_of(runs)
        assert found.state == "lost"
        assert f"process {claim['pid']}" in found.reason

    def test_lost_while_it_ran(self, runs, folder):
        claim = gone()
        folder.write_state(state="running", failures=1, continuations=2, **claim)
        folder.claim.write_text(json.dumps(claim))
        found = state_of(runs)
        assert (found.state, found.failures, found.continuations) == ("lost", 1, 2)

    def test_lost_without_a_claim(self, runs, folder):
        folder.write_state(state="running", failures=0, continuations=0, pid=7, host="elsewhere")
        found = state_of(runs)
        assert found.state == "lost"
        assert "process 7 on elsewhere" in found.reason


class TestUnreadable:
    @pytest.mark.parametrize(
        "content", [b"", b"{", b"[]", b"3", b"null", b"{}", b"\xff\xfe", b'{"state": "compl']
    )
    @pytest.mark.parametrize("name", ["run.json", "claim.json"])
    def test_a_file_that_tells_nothing_does_no_harm(self, runs, folder, name, content):
        (folder.path / name).write_bytes(content)
        assert state_of(runs).state == "waiting"

    @pytest.mark.parametrize("name", ["run.json", "claim.json"])
    def test_a_folder_in_its_place_does_no_harm(self, runs, folder, name):
        (folder.path / name).mkdir()
        assert state_of(runs).state == "waiting"

    @pytest.mark.parametrize("state", [None, 3, "absurd"])
    def test_a_state_that_is_none(self, runs, folder, state):
        folder.write_state(state=state)
        assert state_of(runs).state == "waiting"

    def test_a_run_that_is_a_file(self, runs):
        runs.mkdir()
        (runs / NAME).write_text("")
        assert state_of(runs).state == "waiting"

    def test_it_hides_no_other(self, runs, folder):
        (folder.path / "run.json").write_bytes(b"{")
        other = RunDirectory(runs / "other")
        other.path.mkdir()
        other.write_state(state="interrupted")
        states = run_states([NAME, "other"], runs, asks=never_asked)
        assert [state.state for state in states.values()] == ["waiting", "interrupted"]


def test_a_job_is_asked_for_once(runs):
    asked = []

    def asks(job: str) -> bool:
        asked.append(job)
        return True

    names = [str(number) for number in range(6)]
    for number, name in enumerate(names):
        (runs / name).mkdir(parents=True)
        claim = elsewhere(f"12_{number % 2}")
        RunDirectory(runs / name).claim.write_text(json.dumps(claim))
    states = run_states(names, runs, asks=asks)
    assert {state.state for state in states.values()} == {"running"}
    assert sorted(asked) == ["12_0", "12_1"]


class TestPoints:
    @pytest.fixture
    def plan(self, tmp_path):
        (tmp_path / "scene.json").write_text(json.dumps(INFILTRATION))
        path = tmp_path / "sweep.toml"
        # The first and the last are one scene.
        path.write_text(
            'scene = "scene.json"\n[[axes]]\nkey = "pressure.gradient"\nvalues = [10, 5, 10.0]\n'
        )
        return make_plan(path)

    def test_those_of_one_scene_are_counted_each(self, plan, runs):
        run = RunDirectory(runs / plan.points[0].run)
        run.path.mkdir(parents=True)
        run.write_state(state="interrupted")
        states = run_states({point.run for point in plan.points}, runs)
        counted = points_by_state(plan, states)
        assert tuple(counted) == STATES
        assert {state: count for state, count in counted.items() if count} == {
            "interrupted": 2,
            "waiting": 1,
        }

    def test_those_of_one_scene_are_done_once(self, plan, runs):
        states = run_states({point.run for point in plan.points}, runs)
        assert [point.index for point in to_do(plan, states, 0)] == [0, 1]

    @pytest.mark.parametrize(
        ("state", "failures", "wanted"),
        [
            ("waiting", 0, True),
            ("interrupted", 0, True),
            ("interrupted", 9, True),
            ("lost", 0, True),
            ("failed", 1, True),
            ("failed", 2, False),
            ("done", 0, False),
            ("running", 0, False),
            ("queued", 0, False),
        ],
    )
    def test_what_is_to_be_done(self, plan, state, failures, wanted):
        states = {point.run: RunState("done") for point in plan.points}
        states[plan.points[1].run] = RunState(state, failures=failures)
        found = [point.index for point in to_do(plan, states, retries=1)]
        assert found == ([1] if wanted else [])

    def test_what_was_diagnosed_is_not_tried_again(self, plan, runs):
        """It has a try left; the same again would end the same way."""
        run = RunDirectory(runs / plan.points[1].run)
        run.path.mkdir(parents=True)
        run.write_state(state="failed", failures=1, faults=["lost"], diagnosis={"rule": "lost"})
        states = {point.run: RunState("done") for point in plan.points}
        states |= run_states([plan.points[1].run], runs)
        assert to_do(plan, states, retries=1) == []
        run.write_state(state="failed", failures=1, faults=["lost"], diagnosis=None)
        states |= run_states([plan.points[1].run], runs)
        assert [point.index for point in to_do(plan, states, retries=1)] == [1]


def test_two_thousand_runs_are_read_quickly(runs):
    points = []
    for number in range(2000):
        name = f"{number:016x}"
        run = RunDirectory(runs / name)
        run.path.mkdir(parents=True)
        # The length of a real one.
        run.write_state(state="complete", failures=0, continuations=0, command=["word"] * 40)
        run.results.write_text("{}")
        points.append(Point(number, name, {}, 0, number, 1, 1, None))
    plan = Plan("many", "many.toml", {}, (), tuple(points), 0, 1, SlurmSettings())
    start = time.monotonic()
    counted = points_by_state(plan, run_states({point.run for point in points}, runs))
    elapsed = time.monotonic() - start
    assert counted["done"] == 2000
    # Measured: 0.03 s. Thirty times that is room for a machine that is slow or busy, and none for
    # anything that starts a process or waits at each run.
    assert elapsed < 1.0
