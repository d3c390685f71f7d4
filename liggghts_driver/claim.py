"""The claim on a run directory: one worker at a time, and dead workers found out.

A claim is a file made by one process alone (``O_EXCL``). It tells where that process runs and as
which job, so that others can see when it is gone.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import platform
import uuid
from pathlib import Path
from typing import TYPE_CHECKING, Any

from liggghts_driver.batch import SlurmError, job_states
from liggghts_driver.errors import RunBusyError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from liggghts_driver.rundir import RunDirectory

#: How long the batch system may take to tell of a job.
_PATIENCE_S = 30.0


@contextlib.contextmanager
def claimed(directory: RunDirectory) -> Iterator[None]:
    """Hold the claim on a directory for as long as the block lasts.

    Raises
    ------
    RunBusyError
        If another worker has it, or may have it.
    """
    own = take(directory)
    try:
        yield
    finally:
        # If the whole folder is gone, so is the claim.
        with contextlib.suppress(FileNotFoundError), _alone_with(directory):
            if _text(directory.claim) == own:
                directory.claim.unlink()


def take(directory: RunDirectory) -> str:
    """Make the claim, also in the place of one whose worker is gone; its text.

    Raises
    ------
    RunBusyError
        If another worker has it, or may have it.
    """
    with _alone_with(directory):
        try:
            owner = read_claim(directory)
        except OSError as error:  # a file system that is not well: somebody may be here
            raise RunBusyError(f"{directory.claim}: cannot be read ({error.strerror})") from None
        if owner is not None and alive(owner):
            raise RunBusyError(
                f"{directory.path}: a run is going on here ({describe(owner)}); wait for it, or "
                f"choose another folder. If it is gone, delete {directory.claim.name}"
            )
        directory.claim.unlink(missing_ok=True)
        return _create(directory.claim)


@contextlib.contextmanager
def _alone_with(directory: RunDirectory) -> Iterator[None]:
    """Judge, make and delete claims one at a time: between two looks nothing changes."""
    with (directory.path / "claim.lock").open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def read_claim(directory: RunDirectory) -> dict[str, Any] | None:
    """Who has the claim; None when nobody has. An unreadable claim is nobody's."""
    try:
        claim = json.loads(_text(directory.claim))
    except ValueError:
        return None
    return claim if isinstance(claim, dict) else None


def job_runs(job: str) -> bool:
    """Whether the batch system knows a job as running; true where it cannot be asked."""
    try:
        states = job_states(job, _PATIENCE_S)
    except SlurmError:
        return True
    return any(state in states for state in ("RUNNING", "COMPLETING", "SUSPENDED"))


def alive(claim: dict[str, Any], job_runs: Callable[[str], bool] = job_runs) -> bool:
    """Whether the worker of a claim may still be there; where nothing is known, it may."""
    job = current_job()
    if job is not None and claim.get("job") == job:
        # The batch system runs a job once at a time: this is an earlier start of this very job.
        return claim.get("restarts") == _restarts() and _process_lives(claim)
    if claim.get("host") == platform.node():
        return _process_lives(claim)
    return claim.get("job") is None or job_runs(str(claim["job"]))


def describe(claim: dict[str, Any]) -> str:
    """The worker of a claim, for people."""
    job = f", job {claim['job']}" if claim.get("job") else ""
    return f"process {claim.get('pid')} on {claim.get('host')}{job}"


def current_job() -> str | None:
    """The batch job that this process belongs to, as Slurm names it; None outside of one."""
    array, task = os.environ.get("SLURM_ARRAY_JOB_ID"), os.environ.get("SLURM_ARRAY_TASK_ID")
    return f"{array}_{task}" if array and task else os.environ.get("SLURM_JOB_ID")


def _restarts() -> int:
    return int(os.environ.get("SLURM_RESTART_COUNT", "0"))


def _create(path: Path) -> str:
    """Make the claim's file, by ``O_EXCL`` where it is not; its text.

    Raises
    ------
    RunBusyError
        If it is there: made by somebody whose file system knows no locks.
    """
    facts = {
        "host": platform.node(),
        "pid": os.getpid(),
        "started": _started(os.getpid()),
        "job": current_job(),
        "restarts": _restarts(),
        "id": uuid.uuid4().hex,
    }
    text = json.dumps(facts)
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise RunBusyError(f"{path.parent}: another worker took this run just now") from None
    return text


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except FileNotFoundError:
        return ""


def _process_lives(claim: dict[str, Any]) -> bool:
    """Whether that process of this machine is there, and no later one with its number."""
    pid, started = claim.get("pid"), claim.get("started")
    return isinstance(pid, int) and started is not None and _started(pid) == started


def _started(pid: int) -> int | None:
    """When a process started, in ticks since the machine did; None if it is gone or a zombie."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    fields = text.rpartition(")")[2].split()  # its name, in brackets, may hold anything
    return None if fields[0] == "Z" else int(fields[19])
