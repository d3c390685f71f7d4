"""The claim on a run directory: one worker alone, also where a dead one left its claim."""

from __future__ import annotations

import collections
import contextlib
import json
import multiprocessing
import os
import platform
import subprocess
import threading
import time
from pathlib import Path

import pytest

from liggghts_driver.claim import (
    alive,
    claimed,
    current_job,
    describe,
    job_runs,
    read_claim,
    take,
)
from liggghts_driver.errors import RunBusyError
from liggghts_driver.rundir import RunDirectory

#: More than this machine has cores, so that some are always halfway.
WORKERS = 8
#: With one try a race is seldom seen; each try takes milliseconds.
ROUNDS = 30


@pytest.fixture(autouse=True)
def no_job(monkeypatch):
    """Not in a batch job, whatever these tests themselves run in."""
    for name in [name for name in os.environ if name.startswith("SLURM_")]:
        monkeypatch.delenv(name)


@pytest.fixture
def run(tmp_path):
    directory = RunDirectory(tmp_path / "run")
    directory.path.mkdir()
    return directory


def started(pid: int) -> int:
    """When a process started, in clock ticks: field 22 of its stat file."""
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19])


def facts(pid: int, start: int, **others: object) -> dict[str, object]:
    """A claim as a process of this machine outside of any job makes it."""
    known = {"host": platform.node(), "pid": pid, "started": start, "job": None, "restarts": 0}
    return known | others


def leave(run: RunDirectory, claim: dict[str, object]) -> None:
    """A claim that somebody made before."""
    run.claim.write_text(json.dumps(claim))


def of_finished() -> dict[str, object]:
    """The claim of a process that is gone."""
    process = subprocess.Popen(["sleep", "60"])
    found = facts(process.pid, started(process.pid))
    process.kill()
    process.wait()
    return found


@contextlib.contextmanager
def of_another():
    """The claim of another process, which lives as long as the block."""
    process = subprocess.Popen(["sleep", "60"])
    try:
        yield facts(process.pid, started(process.pid))
    finally:
        process.kill()
        process.wait()


def never_asked(job: str) -> bool:
    raise AssertionError(f"asked for job {job}")


class TestOneAlone:
    def test_it_tells_who_has_it(self, run):
        mine = facts(os.getpid(), started(os.getpid()))
        with claimed(run):
            assert read_claim(run).items() >= mine.items()
        assert read_claim(run) is None

    def test_a_live_process_keeps_it_and_the_message_says_what_to_do(self, run):
        with of_another() as claim:
            leave(run, claim)
            with pytest.raises(RunBusyError) as caught:
                take(run)
            text = str(caught.value)
            assert text.startswith(f"{run.path}: ")
            assert f"process {claim['pid']} on {platform.node()}" in text
            assert text.endswith("delete claim.json")
            assert read_claim(run) == claim

    def test_the_same_process_cannot_have_it_twice(self, run):
        with claimed(run), pytest.raises(RunBusyError):
            take(run)
        take(run)

    @pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit])
    def test_it_is_released_after_an_error(self, run, error):
        with pytest.raises(error), claimed(run):
            raise error
        assert not run.claim.exists()
        take(run)

    def test_nobody_elses_is_released(self, run):
        with of_another() as claim:
            leave(run, claim)
            with pytest.raises(RunBusyError), claimed(run):
                pass
            assert run.claim.exists()

    def test_a_claim_that_was_taken_over_is_not_released(self, run):
        """As after somebody deleted the claim of a worker who was still there."""
        with of_another() as claim:
            with claimed(run):
                leave(run, claim)
            assert read_claim(run) == claim

    def test_nothing_but_the_lock_stays_behind(self, run):
        leave(run, of_finished())
        with claimed(run):
            pass
        assert {path.name for path in run.path.iterdir()} <= {"claim.lock"}


def compete(folders: list[Path], barrier, results) -> None:
    """Try for the claims of some folders, each at the same time as others."""
    won, errors = [], []
    for number, folder in enumerate(folders):
        barrier.wait(60)
        try:
            take(RunDirectory(folder))
            won.append(number)
        except RunBusyError:
            pass
        except Exception as error:  # noqa: BLE001 - told to the test
            errors.append(f"round {number}: {error!r}")
    barrier.wait(60)  # all live until the end: none of them is a dead worker
    results.put((os.getpid(), won, errors))


def make_folders(tmp_path: Path, rounds: int, claim: dict[str, object] | None) -> list[Path]:
    folders = [tmp_path / str(number) for number in range(rounds)]
    for folder in folders:
        folder.mkdir()
        if claim is not None:
            leave(RunDirectory(folder), claim)
    return folders


class TestManyAtOnce:
    @pytest.mark.parametrize("found", ["no claim", "a dead one", "an unreadable one"])
    def test_one_of_many_processes_wins(self, tmp_path, found):
        folders = make_folders(tmp_path, ROUNDS, of_finished() if found == "a dead one" else None)
        if found == "an unreadable one":
            for folder in folders:
                RunDirectory(folder).claim.write_text("{")
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload(["liggghts_driver.claim", "liggghts_driver.rundir"])
        barrier, results = context.Barrier(WORKERS), context.Queue()
        arguments = (folders, barrier, results)
        workers = [context.Process(target=compete, args=arguments) for _ in range(WORKERS)]
        for worker in workers:
            worker.start()
        told = [results.get(timeout=60) for _ in workers]
        for worker in workers:
            worker.join(60)
        assert [line for _, _, errors in told for line in errors] == []
        assert sorted(number for _, won, _ in told for number in won) == list(range(ROUNDS))
        for pid, won, _ in told:
            for number in won:
                assert read_claim(RunDirectory(folders[number]))["pid"] == pid

    @pytest.mark.parametrize("found", ["no claim", "a dead one"])
    def test_one_of_many_threads_wins(self, tmp_path, found):
        """As in a sweep on this machine, whose runs each have a thread of one process."""
        rounds = 5 * ROUNDS  # threads of one process seldom get in each other's way
        folders = make_folders(tmp_path, rounds, of_finished() if found == "a dead one" else None)
        barrier, results = threading.Barrier(WORKERS), collections.deque()

        class Results:
            put = results.append

        arguments = (folders, barrier, Results)
        workers = [threading.Thread(target=compete, args=arguments) for _ in range(WORKERS)]
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join(60)
        assert [line for _, _, errors in results for line in errors] == []
        assert sorted(number for _, won, _ in results for number in won) == list(range(rounds))

    def test_a_claim_made_while_an_old_one_is_judged_stays(self, run, monkeypatch):
        """One worker releases it, and a third takes it, before the second does what it decided."""
        over, won = threading.Event(), []

        def old_one():
            with claimed(run):
                over.wait(60)

        def try_for_it(name: str):
            with contextlib.suppress(RunBusyError):
                take(run)
                won.append(name)

        old = threading.Thread(target=old_one)
        third = threading.Thread(target=try_for_it, args=["third"])

        def read_and_be_late(directory: RunDirectory):
            found = read_claim(directory)
            if threading.current_thread() is threading.main_thread():
                # Long where these two have to wait until the judge is done; they do so no longer.
                over.set()
                old.join(0.5)
                found = read_claim(directory)
                third.start()
                third.join(0.5)
            return found

        old.start()
        while read_claim(run) is None:
            time.sleep(0.001)
        monkeypatch.setattr("liggghts_driver.claim.read_claim", read_and_be_late)
        try_for_it("second")
        old.join(60)
        third.join(60)
        assert len(won) <= 1
        assert run.claim.exists() == bool(won)


class TestDeadWorkers:
    def test_a_process_that_is_gone(self, run):
        dead = of_finished()
        assert not alive(dead, never_asked)
        leave(run, dead)
        with claimed(run):
            assert read_claim(run)["pid"] == os.getpid()

    def test_a_number_that_went_to_another_process(self):
        with of_another() as claim:
            assert alive(claim, never_asked)
            assert not alive(claim | {"started": claim["started"] - 1}, never_asked)

    def test_a_zombie(self):
        process = subprocess.Popen(["sleep", "60"])
        claim = facts(process.pid, started(process.pid))
        process.kill()
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
        try:
            assert "\nState:\tZ" in Path(f"/proc/{process.pid}/status").read_text()
            assert not alive(claim, never_asked)
        finally:
            process.wait()

    @pytest.mark.parametrize("key", ["pid", "started"])
    @pytest.mark.parametrize("value", [None, "12", -1, {}])
    def test_a_claim_of_this_machine_that_names_no_process(self, key, value):
        assert not alive(facts(os.getpid(), started(os.getpid())) | {key: value}, never_asked)

    @pytest.mark.parametrize("content", [b"", b"{", b"[]", b"3", b"\xff\xfe", b'{"host": "h'])
    def test_an_unreadable_claim_is_nobodys(self, run, content):
        run.claim.write_bytes(content)
        assert read_claim(run) is None
        with claimed(run):
            assert read_claim(run)["pid"] == os.getpid()


class TestOtherMachines:
    def elsewhere(self, **others: object) -> dict[str, object]:
        return facts(os.getpid(), 1, host=f"{platform.node()}-other", **others)

    def test_without_a_job_it_may_be_there(self, run):
        claim = self.elsewhere()
        assert alive(claim, never_asked)
        leave(run, claim)
        with pytest.raises(RunBusyError, match=rf"on {claim['host']}\).*delete claim\.json$"):
            take(run)
        assert read_claim(run) == claim

    @pytest.mark.parametrize("runs", [True, False])
    def test_with_a_job_the_batch_system_is_asked(self, runs):
        asked = []

        def asks(job: str) -> bool:
            asked.append(job)
            return runs

        assert alive(self.elsewhere(job="12_3"), asks) is runs
        assert asked == ["12_3"]

    def test_a_process_of_this_machine_is_looked_at_itself(self):
        """The job may go on with its next run when the worker of this one is gone."""
        assert not alive(of_finished() | {"job": "12"}, never_asked)
        with of_another() as claim:
            assert alive(claim | {"job": "12"}, never_asked)

    def test_who_it_is(self):
        assert describe(self.elsewhere(job="12_3")).endswith("-other, job 12_3")
        assert "job" not in describe(facts(1, 1, host="host"))


class TestTheSameJobAgain:
    """The batch system starts a job anew, maybe elsewhere, when its machine has gone."""

    @pytest.fixture(autouse=True)
    def _second_start(self, monkeypatch):
        monkeypatch.setenv("SLURM_JOB_ID", "12")
        monkeypatch.setenv("SLURM_RESTART_COUNT", "1")

    @pytest.mark.parametrize("host", ["gone", platform.node()])
    def test_its_earlier_start_is_dead(self, host):
        with of_another() as claim:
            assert not alive(claim | {"host": host, "job": "12", "restarts": 0}, never_asked)

    def test_this_start_lives_as_long_as_its_process(self):
        with of_another() as claim:
            now = claim | {"job": "12", "restarts": 1}
            assert alive(now, never_asked)
        assert not alive(now, never_asked)

    def test_another_job_is_judged_as_ever(self):
        with of_another() as claim:
            other = claim | {"host": "elsewhere", "job": "13", "restarts": 0}
            assert alive(other, lambda _job: True)
            assert not alive(other, lambda _job: False)

    def test_the_claim_keeps_which_start_it_was(self, run):
        with claimed(run):
            claim = read_claim(run)
        assert (claim["job"], claim["restarts"]) == ("12", 1)


@pytest.mark.parametrize(
    ("environment", "job"),
    [
        ({}, None),
        ({"SLURM_JOB_ID": "15"}, "15"),
        (
            {"SLURM_JOB_ID": "15", "SLURM_ARRAY_JOB_ID": "12", "SLURM_ARRAY_TASK_ID": "3"},
            "12_3",
        ),
        ({"SLURM_JOB_ID": "15", "SLURM_ARRAY_JOB_ID": "12", "SLURM_ARRAY_TASK_ID": "0"}, "12_0"),
        ({"SLURM_JOB_ID": "15", "SLURM_ARRAY_TASK_ID": "3"}, "15"),
    ],
    ids=str,
)
def test_the_name_of_a_job(monkeypatch, environment, job):
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert current_job() == job


#: The states of some jobs, told in the way of Slurm.
SQUEUE = """#!/bin/sh
echo "$*" >> "$(dirname "$0")/asked"
case "$*" in
*"--jobs 1 "*) echo RUNNING ;;
*"--jobs 2 "*) echo PENDING ;;
*"--jobs 3 "*) ;;
*"--jobs 4 "*) echo "slurm_load_jobs error: Invalid job id specified" >&2; exit 1 ;;
*"--jobs 5 "*) echo "slurm_load_jobs error: Unable to contact slurm controller" >&2; exit 1 ;;
*"--jobs 6 "*) echo COMPLETING ;;
*"--jobs 7 "*) echo SUSPENDED ;;
*"--jobs 8_2 "*) printf 'PENDING\\nRUNNING\\n' ;;
esac
"""


class TestSqueue:
    @pytest.fixture(autouse=True)
    def squeue(self, tmp_path, monkeypatch):
        folder = tmp_path / "bin"
        folder.mkdir()
        (folder / "squeue").write_text(SQUEUE)
        (folder / "squeue").chmod(0o755)
        monkeypatch.setenv("PATH", f"{folder}:{os.environ['PATH']}")
        return folder

    @pytest.mark.parametrize(
        ("job", "runs"),
        [
            pytest.param("1", True, id="running"),
            pytest.param("2", False, id="pending"),
            pytest.param("3", False, id="ended"),
            pytest.param("4", False, id="unknown"),
            pytest.param("5", True, id="controller silent"),
            pytest.param("6", True, id="completing"),
            pytest.param("7", True, id="suspended"),
            pytest.param("8_2", True, id="one of several"),
        ],
    )
    def test_what_it_says(self, squeue, job, runs):
        assert job_runs(job) is runs
        assert (squeue / "asked").read_text() == f"--noheader --jobs {job} --format %T\n"

    def test_it_is_not_asked_through_a_user_s_own_filters(self, squeue, monkeypatch):
        """Else a job in another state would look as if it had ended."""
        (squeue / "squeue").write_text('#!/bin/sh\n[ -z "$SQUEUE_STATES" ] && echo RUNNING\n')
        monkeypatch.setenv("SQUEUE_STATES", "PENDING")
        assert job_runs("1")

    @pytest.mark.parametrize(("job", "busy"), [("1", True), ("4", False)])
    def test_it_decides_on_a_claim_of_another_machine(self, run, job, busy):
        leave(run, facts(1, 1, host="elsewhere", job=job))
        if busy:
            with pytest.raises(RunBusyError, match="job 1"):
                take(run)
        else:
            take(run)
            assert read_claim(run)["pid"] == os.getpid()

    def test_without_it_a_job_may_run(self, tmp_path, monkeypatch):
        monkeypatch.setenv("PATH", str(tmp_path))
        assert job_runs("4")
