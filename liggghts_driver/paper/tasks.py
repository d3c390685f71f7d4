"""What is to be run for the page: the points of its sweeps, each run once."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from liggghts_driver.paper.catalogue import sweep_file
from liggghts_driver.sweeps.plan import make_plan, write_plan
from liggghts_driver.sweeps.status import run_states
from liggghts_driver.sweeps.tasks import task_of, to_do

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from liggghts_driver.sweeps.task import Task


def tasks_to_do(names: Sequence[str], runs: Path) -> list[Task]:
    """The points of some sweeps that are still to be done, in their order.

    Each sweep's plan is kept beside the folder of the runs, where the commands of sweeps find it.

    Parameters
    ----------
    names
        Of shipped sweeps.
    runs
        The folder of all runs.

    Raises
    ------
    SweepError
        If a sweep cannot be run as it is.
    """
    tasks: dict[Path, Task] = {}
    for name in names:
        plan = make_plan(sweep_file(name))
        write_plan(plan, runs.parent / f"sweep-{name}")
        states = run_states({point.run for point in plan.points}, runs)
        for point in to_do(plan, states, plan.retries):
            task = task_of(plan, point, runs)
            tasks.setdefault(task.folder, replace(task, name=f"{name}: {task.name}"))
    return list(tasks.values())
