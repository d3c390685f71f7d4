"""Work on one run of a sweep: done before, done now, failed, interrupted, or another's."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from liggghts_driver.claim import claimed
from liggghts_driver.errors import (
    DriverError,
    EngineNotFoundError,
    RunBusyError,
    RunFolderError,
    RunInterrupted,
    RunUnstableError,
)
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.solve import solve
from liggghts_driver.sweeps.task import Outcome, Task
from liggghts_driver.watch import recorded_finding

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from liggghts_driver.case import Case
    from liggghts_driver.engine.stop import Stop
    from liggghts_driver.scene.model import Scene


def is_done(folder: Path) -> bool:
    """Whether a run is whole and analysed."""
    run = RunDirectory(folder)
    return run.results.exists() and run.read_state()["state"] == "complete"


def failures(folder: Path) -> int:
    """How often a run has failed."""
    return int(RunDirectory(folder).read_state().get("failures", 0))


def work_on(
    task: Task,
    retries: int = 0,
    stop: Stop | None = None,
    on_case: Callable[[Case], None] = lambda _case: None,
    on_step: Callable[[int], None] = lambda _step: None,
) -> Outcome:
    """Do a task, unless it is done or somebody is on it.

    Parameters
    ----------
    task
        What to do.
    retries
        How often it is tried again when it fails, failures of the past counted.
    stop
        The wish that it end at its next checkpoint.
    on_case, on_step
        As for ``solve``.
    """
    if is_done(task.folder):
        return Outcome("done", reused=True)
    outcome = Outcome("failed", _last_reason(task.folder))
    for _ in range(retries + 1 - failures(task.folder)):
        try:
            outcome = _once(task, stop, on_case, on_step)
        except (EngineNotFoundError, RunFolderError) as error:
            # No fault of the run, and trying again is no use.
            return Outcome("failed", str(error))
        if outcome.ending != "failed" or recorded_finding(RunDirectory(task.folder)):
            return outcome  # what was stopped for a reason would be stopped for it again
    return outcome


def _once(
    task: Task,
    stop: Stop | None,
    on_case: Callable[[Case], None],
    on_step: Callable[[int], None],
) -> Outcome:
    """One try, after which a failure stands in the run directory."""
    before = failures(task.folder)
    scene = task.scene()
    try:
        solve(
            scene, task.folder, task.ranks, on_case, on_step, stop, report=False, alter=task.alter
        )
    except RunInterrupted as interrupted:
        return Outcome("interrupted", str(interrupted))
    except RunBusyError as busy:
        return Outcome("busy", str(busy))
    except (EngineNotFoundError, RunFolderError):
        raise  # not noted in the folder: it may be somebody else's
    except RunUnstableError:
        return Outcome("failed", _last_reason(task.folder))  # noted already
    except DriverError as error:
        if failures(task.folder) == before:
            with contextlib.suppress(RunBusyError):  # then another worker will note its own
                _record(task.folder, scene, before + 1, str(error))
        return Outcome("failed", _last_reason(task.folder))
    return Outcome("done")


def _record(folder: Path, scene: Scene, number: int, reason: str) -> None:
    """Note a failure that came before or after the engine's own run."""
    run = RunDirectory(folder)
    folder.mkdir(parents=True, exist_ok=True)
    with claimed(run):
        if not run.scene.exists():
            run.write_scene(scene)
        known = run.read_state() | {"state": "failed", "failures": number}
        run.write_state(**known | {"faults": reason.splitlines()[:1]})


def _last_reason(folder: Path) -> str:
    faults = RunDirectory(folder).read_state().get("faults") or ["it failed before"]
    return str(faults[0])
