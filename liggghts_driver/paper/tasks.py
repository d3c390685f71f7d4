"""What is to be run for the page: the points of its sweeps, each run once."""

from __future__ import annotations

from dataclasses import replace
from operator import itemgetter
from typing import TYPE_CHECKING

from liggghts_driver.errors import RunFolderError
from liggghts_driver.paper.catalogue import sweep_file
from liggghts_driver.sweeps.plan import make_plan, write_plan
from liggghts_driver.sweeps.status import run_states
from liggghts_driver.sweeps.tasks import task_of, to_do

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from liggghts_driver.paper.stored import Stored
    from liggghts_driver.sweeps.plan import Plan
    from liggghts_driver.sweeps.task import Task


def tasks_to_do(names: Sequence[str], runs: Path, stored: Stored | None = None) -> list[Task]:
    """The points of some sweeps that are still to be done: the first packing of each before others.

    All of it takes long: so the page tells of every reading soon, and of its spread later. Each
    sweep's plan is kept beside the folder of the runs, where the commands of sweeps find it.

    Parameters
    ----------
    names
        Of shipped sweeps.
    runs
        The folder of all runs.
    stored
        Points that have an answer here are not to be done; by default all are.

    Raises
    ------
    SweepError
        If a sweep cannot be run as it is.
    """
    known = {point.run for point in stored.points() if point.answer} if stored else set()
    found: dict[Path, tuple[int, Task]] = {}
    for name in names:
        plan = make_plan(sweep_file(name))
        _keep(plan, runs.parent / f"sweep-{name}")
        states = run_states({point.run for point in plan.points}, runs)
        for point in to_do(plan, states, plan.retries):
            if point.run in known:
                continue
            task = task_of(plan, point, runs)
            named = replace(task, name=f"{name}: {task.name}")
            found.setdefault(task.folder, (point.replicate, named))
    return [task for _, task in sorted(found.values(), key=itemgetter(0))]


def _keep(plan: Plan, folder: Path) -> None:
    """Keep a plan, beside that of an earlier version of the shipped file where there is one."""
    try:
        write_plan(plan, folder)
    except RunFolderError:
        write_plan(plan, folder.with_name(f"{folder.name}-{plan.file_sha256[:8]}"))
