"""What was submitted, and what of it is still in the queue: sbatch, squeue, scontrol, scancel only.

The database of a cluster, and with it ``sacct``, is not there everywhere and is never asked.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from liggghts_driver.batch import UNKNOWN_JOB, SlurmError, job_states, slurm
from liggghts_driver.outputs import write_text

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

#: Name of the folder of a sweep's jobs, and in it of the file that tells what was submitted.
JOBS_FOLDER = "jobs"
SUBMITTED_FILE = "submitted.json"


@dataclass(frozen=True)
class Submission:
    """One array that was submitted.

    Attributes
    ----------
    job_id
        Of the array; its tasks are ``<job_id>_0``, ``<job_id>_1``, ...
    points
        Name of its list file in the jobs folder: for each task a line with its point indices.
    tasks
        Number of tasks.
    submitted
        When, with the time zone.
    cluster
        Name of the cluster; job ids mean nothing on another.
    """

    job_id: int
    points: str
    tasks: int
    submitted: str
    cluster: str


def configuration() -> dict[str, str]:
    """The settings of the cluster, by key.

    Raises
    ------
    SlurmError
        If the cluster does not tell them.
    """
    pairs = (line.split("=", 1) for line in slurm("scontrol", "show", "config").splitlines())
    return {pair[0].strip(): pair[1].strip() for pair in pairs if len(pair) == 2}


def read_submissions(folder: Path) -> list[Submission]:
    """What was submitted for the sweep in a folder, the oldest first.

    Raises
    ------
    SlurmError
        If the file that tells it cannot be read.
    """
    path = folder / JOBS_FOLDER / SUBMITTED_FILE
    try:
        return [Submission(**each) for each in json.loads(path.read_text(encoding="utf-8"))]
    except FileNotFoundError:
        return []
    except (OSError, ValueError, TypeError) as error:
        raise SlurmError(
            f"{path}: cannot be read ({error}); move it away if none of its jobs is queued"
        ) from None


def record(folder: Path, submission: Submission) -> None:
    """Add an array to what was submitted."""
    known = [asdict(each) for each in (*read_submissions(folder), submission)]
    write_text(folder / JOBS_FOLDER / SUBMITTED_FILE, json.dumps(known, indent=2) + "\n")


def queue(submissions: Sequence[Submission]) -> dict[str, str]:
    """Tasks that are in the queue, ``<job>_<task>`` to state, as squeue calls it.

    A task that is not in it has ended. Held tasks and those to be run again are PENDING;
    COMPLETING ones may still have processes.

    Raises
    ------
    SlurmError
        If squeue cannot tell, or the jobs are of another cluster: then nothing is known.
    """
    if not submissions:
        return {}
    _require_same_cluster(submissions)
    return _ask(",".join(str(each.job_id) for each in submissions))


def _require_same_cluster(submissions: Iterable[Submission]) -> None:
    here = configuration().get("ClusterName", "")
    for each in submissions:
        if each.cluster != here:
            raise SlurmError(
                f"job {each.job_id} was submitted to the cluster {each.cluster}, and this is "
                f"{here}; ask there, or take it out of {JOBS_FOLDER}/{SUBMITTED_FILE} if it has "
                "ended"
            )


def _ask(jobs: str) -> dict[str, str]:
    """State of every queued task of some jobs, in one call; ``-r``: each on a line of its own."""
    try:
        text = slurm("squeue", "--noheader", "-r", "-o", "%i|%T", "-j", jobs)
    except SlurmError as error:
        if UNKNOWN_JOB in str(error):
            return {}
        raise
    return parse_queue(text)


def parse_queue(text: str) -> dict[str, str]:
    """What ``squeue -r -o '%i|%T'`` printed: task or job to state.

    Raises
    ------
    SlurmError
        If it is something else.
    """
    found = {}
    for line in text.splitlines():
        task, bar, state = line.strip().partition("|")
        job, _, number = task.partition("_")
        if not (bar and state and job.isdecimal() and (number.isdecimal() or "_" not in task)):
            raise SlurmError(f"squeue: printed {line!r} where a task and its state were asked for")
        found[task] = state
    return found


def task_state(job_id: int, task: int | None = None) -> str | None:
    """State of a task of an array, or of a job without tasks; None when it is not in the queue.

    Raises
    ------
    SlurmError
        If squeue cannot tell.
    """
    states = job_states(str(job_id) if task is None else f"{job_id}_{task}")
    return states[0] if states else None


def task_alive(job_id: int, task: int | None = None) -> bool:
    """Whether a task is in the queue: it runs, or will.

    Raises
    ------
    SlurmError
        If squeue cannot tell.
    """
    return task_state(job_id, task) is not None


def read_points(folder: Path, submission: Submission) -> list[tuple[int, ...]]:
    """Point indices of each task of an array.

    Raises
    ------
    SlurmError
        If its list file cannot be read.
    """
    path = folder / JOBS_FOLDER / submission.points
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
        return [tuple(map(int, line.split())) for line in lines]
    except (OSError, ValueError) as error:
        raise SlurmError(
            f"{path}: cannot be read ({error}); it tells what job {submission.job_id} runs"
        ) from None


def points_in_queue(folder: Path) -> dict[int, tuple[str, str]]:
    """Points of a sweep whose job is in the queue: index to its task and the task's state.

    Of a point with several tasks the one that is beyond PENDING is told.

    Raises
    ------
    SlurmError
        If squeue cannot tell, or a file in the jobs folder cannot be read.
    """
    submissions = read_submissions(folder)
    states = queue(submissions)
    jobs = {task.partition("_")[0] for task in states}
    found: dict[int, tuple[str, str]] = {}
    for each in submissions:
        if str(each.job_id) in jobs:
            _add_points(found, each, read_points(folder, each), states)
    return found


def _add_points(
    found: dict[int, tuple[str, str]],
    submission: Submission,
    points: Sequence[Sequence[int]],
    states: Mapping[str, str],
) -> None:
    for number, indices in enumerate(points):
        task = f"{submission.job_id}_{number}"
        if task not in states:
            continue
        for index in indices:
            if index not in found or found[index][1] == "PENDING":
                found[index] = (task, states[task])


def cancel(folder: Path) -> list[str]:
    """Cancel every job of a sweep that is in the queue; the tasks that were.

    Raises
    ------
    SlurmError
        If squeue cannot tell which, or scancel fails.
    """
    tasks = list(queue(read_submissions(folder)))
    jobs = sorted({task.partition("_")[0] for task in tasks}, key=int)
    if jobs:
        slurm("scancel", *jobs)
    return tasks
