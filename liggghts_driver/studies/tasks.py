"""The runs of a study: every way of running a scene with every seed, on the sweeps' machinery."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Protocol, TypeVar

from liggghts_driver.engine.stop import signals_as_wishes
from liggghts_driver.identity import templates_hash
from liggghts_driver.sweeps.draft import run_name
from liggghts_driver.sweeps.local import cores_here, run_local
from liggghts_driver.sweeps.task import Outcome, Task
from liggghts_driver.sweeps.work import failures, is_done

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from liggghts_driver.case import Case
    from liggghts_driver.engine.stop import Stop
    from liggghts_driver.scene.model import Scene
    from liggghts_driver.sweeps.task import Listener


class Way(Protocol):
    """One way of running a scene: a variant, a setting."""

    @property
    def title(self) -> str:
        """As people call it; no two of a study have the same."""

    def scene(self, scene: Scene, seed: int, /) -> Scene:
        """A scene run in this way, with a seed of its own."""


AnyWay = TypeVar("AnyWay", bound=Way)


def tasks_in_turn(
    ways: Sequence[AnyWay], scene: Scene, seeds: Sequence[int], runs: Path
) -> dict[tuple[AnyWay, int], Task]:
    """All ways in turn for one seed, then for the next: a machine that drifts favours none.

    Parameters
    ----------
    ways
        How the scene is run.
    scene
        What the study is about.
    seeds
        The same for every way.
    runs
        The folder of all runs, shared with sweeps: each is named by the hash of its scene.

    Raises
    ------
    SceneError
        If the scene cannot be run in one of the ways.
    """
    return {(way, seed): _task(way, scene, seed, runs) for seed in seeds for way in ways}


def unfinished(tasks: Sequence[Task]) -> list[Task]:
    """The tasks that are still to be done."""
    return [task for task in tasks if not is_done(task.folder)]


def run_tasks(
    tasks: Sequence[Task], stop: Stop, listener: Listener | None = None
) -> dict[str, Outcome]:
    """Run tasks one after another on one core, so that their times can be compared.

    What is done is found, what was interrupted goes on from its last checkpoint. A run that failed
    before is tried once more, after all others; a failure stops none of them.

    Parameters
    ----------
    tasks
        What to do.
    stop
        The wish that it end, at the next checkpoint; signals express it too.
    listener
        Is told how those go on that are still to be done.

    Returns
    -------
    Name of a task to how it ended; tasks whose turn never came are not in it.
    """
    to_do = unfinished(tasks)
    found = {task.name for task in tasks} - {task.name for task in to_do}
    outcomes = {name: Outcome("done", reused=True) for name in found}
    past = {task.name: failures(task.folder) for task in to_do}
    with signals_as_wishes(stop):
        # The sweeps' number of retries counts the failures of the past.
        for count in sorted(set(past.values())):
            some = [task for task in to_do if past[task.name] == count]
            outcomes |= run_local(some, stop, count, cores_here()[:1], listener)
    return outcomes


def untried(tasks: Sequence[Task]) -> list[Task]:
    """The tasks that are still to be done and have not failed."""
    return [task for task in unfinished(tasks) if not failures(task.folder)]


def run_side_by_side(
    tasks: Sequence[Task], stop: Stop, listener: Listener | None = None
) -> dict[str, Outcome]:
    """Run tasks on all cores at once, whose times nobody compares; what failed before has failed.

    Arguments and what is returned are as of ``run_tasks``; of what is not untried nothing is told.
    """
    return run_local(untried(tasks), stop, listener=listener)


def core_s(cost: Mapping[str, float]) -> float:
    """A run's processor time, which other work on the machine changes little; else by the clock."""
    return cost.get("cpu_s") or cost["wall_s"] * cost["ranks"]


def _task(way: Way, scene: Scene, seed: int, runs: Path) -> Task:
    wanted = way.scene(scene, seed)
    # What a sweep has done, a study finds.
    return task_of(f"{way.title}, seed {seed}", wanted, runs / run_name(wanted, seed))


def task_of(
    name: str, scene: Scene, folder: Path, alter: Callable[[Case], Case] | None = None
) -> Task:
    """A run of a scene that is there already, ``alter`` as for ``solve``."""
    return Task(name, partial(_same, scene), folder, alter=alter)


def run_folder(scene: Scene, runs: Path) -> Path:
    """The folder of a run that other templates are not to find as done: they are another input."""
    return runs / f"{run_name(scene, scene.seed)}-{templates_hash()[:8]}"


def _same(scene: Scene) -> Scene:
    return scene


def first_fault(error: Exception) -> str:
    """The mistake itself, where the first line tells the file and how many there are."""
    lines = [line.strip(" -") for line in str(error).splitlines()]
    return lines[1] if len(lines) > 1 and "mistake" in lines[0] else lines[0]
