"""Hand the points of a sweep to Slurm as job arrays; Slurm does all the scheduling."""

from __future__ import annotations

import re
import time
from typing import TYPE_CHECKING

from liggghts_driver.batch import SlurmError, slurm
from liggghts_driver.outputs import write_text
from liggghts_driver.sweeps.slurm_queue import (
    JOBS_FOLDER,
    Submission,
    cancel,
    configuration,
    points_in_queue,
    queue,
    read_points,
    read_submissions,
    record,
    task_alive,
    task_state,
)
from liggghts_driver.sweeps.slurm_script import (
    Array,
    directives,
    group_points,
    job_name,
    output_of,
    render_script,
    require_long_enough,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    from liggghts_driver.sweeps.plan import Plan

__all__ = [
    "Array",
    "SlurmError",
    "Submission",
    "cancel",
    "group_points",
    "points_in_queue",
    "queue",
    "read_points",
    "read_submissions",
    "submit",
    "task_alive",
    "task_state",
]

_JOB_ID = re.compile(r"^(\d+)(?:;\S*)?$", re.MULTILINE)


def submit(
    plan: Plan, indices: Iterable[int], folder: Path, worker_command: Sequence[str]
) -> list[Submission]:
    """Submit points as arrays, one for each kind of needs and as many as the cluster's limit makes.

    For each array the jobs folder gets a list file, a script, and a line in ``submitted.json``.

    Parameters
    ----------
    plan
        The sweep.
    indices
        Points to run.
    folder
        Of the sweep.
    worker_command
        Program and arguments of what runs the points of a task. It is started in the folder in
        which it is submitted, and told ``--list <file> --task <line of the file, from 0>``.

    Raises
    ------
    SlurmError
        If a time limit is too short, the template is no good, or Slurm refuses; what was
        submitted before is recorded and stays.
    """
    points = [plan.points[index] for index in indices]
    require_long_enough(points)
    settings = configuration()
    made: list[Submission] = []
    for array in group_points(points, plan.pack, largest_array(settings)):
        try:
            made.append(_submit_array(plan, array, folder.absolute(), worker_command, settings))
        except SlurmError as error:
            raise SlurmError(f"{error}{_circumstances(array, settings, made)}") from None
    return made


def largest_array(settings: Mapping[str, str]) -> int:
    """Tasks of one array, at most, by the settings of a cluster.

    ``MaxArraySize`` is one above the highest number of a task, and tasks count from 0.

    Raises
    ------
    SlurmError
        If the cluster takes no arrays.
    """
    largest = int(settings.get("MaxArraySize", "1001"))
    own = re.search(r"\bmax_array_tasks=(\d+)", settings.get("SchedulerParameters", ""))
    largest = min(largest, int(own.group(1))) if own else largest
    if largest < 1:
        raise SlurmError("this cluster takes no job arrays (MaxArraySize = 0); ask its admins")
    return largest


def _submit_array(
    plan: Plan,
    array: Array,
    folder: Path,
    worker_command: Sequence[str],
    settings: Mapping[str, str],
) -> Submission:
    jobs = folder / JOBS_FOLDER
    number = _write_points(jobs, array)
    output = output_of(jobs, number)
    points, script = jobs / f"{number}.points", jobs / f"{number}.sh"
    lines = directives(array, job_name(folder, number), plan.slurm)
    write_text(script, render_script(lines, worker_command, points, plan.slurm.template))
    printed = slurm("sbatch", "--parsable", f"--output={output}", script.name, folder=jobs)
    match = _JOB_ID.search(printed)
    if match is None:
        raise SlurmError(f"sbatch: told no job id but {printed.strip()!r}")
    submission = Submission(
        job_id=int(match.group(1)),
        points=points.name,
        tasks=len(array.tasks),
        submitted=time.strftime("%Y-%m-%dT%H:%M:%S%z"),
        cluster=settings.get("ClusterName", ""),
    )
    record(folder, submission)
    return submission


def _write_points(jobs: Path, array: Array) -> int:
    """Write the list file of an array under the first number that is free; that number."""
    jobs.mkdir(parents=True, exist_ok=True)
    text = "".join(f"{' '.join(map(str, task))}\n" for task in array.tasks)
    number = 1
    while True:
        try:
            with (jobs / f"{number}.points").open("x", encoding="utf-8") as file:
                file.write(text)
        except FileExistsError:
            number += 1
        else:
            return number


def _circumstances(array: Array, settings: Mapping[str, str], made: Sequence[Submission]) -> str:
    """What helps to understand why an array was refused."""
    limits = ", ".join(
        f"{key} = {settings[key]}" for key in ("MaxArraySize", "MaxJobCount") if key in settings
    )
    before = ", ".join(str(each.job_id) for each in made) or "none"
    return (
        f"\n  the array: tasks = {len(array.tasks)}, ranks = {array.ranks}, nodes = {array.nodes}"
        f"\n  limits of the cluster: {limits}"
        f"\n  submitted before it, and recorded: {before}"
    )
