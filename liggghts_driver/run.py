"""A run: found finished, gone on with, or begun; and what is known of it when it is complete."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from liggghts_driver.attempt import Attempt
from liggghts_driver.claim import claimed
from liggghts_driver.engine.completion import missing_data
from liggghts_driver.engine.stop import Stop
from liggghts_driver.errors import ParseError, RunFolderError
from liggghts_driver.identity import scene_hash
from liggghts_driver.results.thermo import Thermo, read_logs
from liggghts_driver.written import require_same_deck

if TYPE_CHECKING:
    from collections.abc import Callable

    from liggghts_driver.case import Case
    from liggghts_driver.rundir import RunDirectory


@dataclass(frozen=True)
class FinishedRun:
    """A run that is proven complete.

    ``reused`` tells that it was found finished and nothing was computed; ``cpu_s`` is None where
    an older version ran it. ``begun_again`` is why it did not go on from a checkpoint, if so.
    """

    case: Case
    directory: RunDirectory
    thermo: Thermo
    ranks: int
    wall_s: float
    cpu_s: float | None
    command: tuple[str, ...]
    engine: str
    parts: dict[str, float]
    reused: bool
    begun_again: str | None


def run_case(
    case: Case,
    directory: RunDirectory,
    ranks: int = 1,
    on_step: Callable[[int], None] = lambda _step: None,
    stop: Stop | None = None,
    on_note: Callable[[str], None] = lambda _note: None,
) -> FinishedRun:
    """Run a case, go on with it from its last checkpoint, or find it finished.

    Parameters
    ----------
    case
        What to run.
    directory
        Where: an absent or empty folder, or one that holds this very scene. What an earlier
        unfinished attempt left there after its last checkpoint is moved aside, never overwritten.
    ranks
        MPI processes.
    on_step
        Called with each step that the engine reports.
    stop
        The wish that it end, which signals express too; and how often it makes checkpoints.
    on_note
        Called with what a user should know while it runs: that it begins again, and why.

    Raises
    ------
    RunFolderError
        If the folder holds anything else, or another process works there.
    EngineNotFoundError
        If the engine or a launcher is missing.
    RunError
        If the engine failed or its run is not whole; the folder stays.
    RunInterrupted
        If it was asked to end, and did at a checkpoint.
    """
    directory.claim_for(case.identity)
    with claimed(directory):
        if directory.read_state()["state"] == "complete":
            require_same_deck(case, directory, scene_hash(case.identity))
            return finished_run(case, directory, reused=True)
        attempt = Attempt(case, directory, ranks, on_step, stop or Stop(), on_note)
        thermo = attempt.run()
        return finished_run(case, directory, reused=False, thermo=thermo)


def finished_run(
    case: Case, directory: RunDirectory, *, reused: bool, thermo: Thermo | None = None
) -> FinishedRun:
    """What is known of a run that is complete on disk; its log is read where it was not yet.

    Raises
    ------
    RunFolderError
        If the run was recorded by a version of this software that kept less of it, or what it
        wrote is not whole any more.
    """
    state = directory.read_state()
    missing = {"time", "ranks", "wall_s", "command", "engine", "parts"} - state.keys()
    if missing:
        raise RunFolderError(
            f"{directory.state}: does not tell {', '.join(sorted(missing))}; it was written by "
            "another version of this software, run the scene again in another folder"
        )
    case = replace(case, time=replace(case.time, **state["time"]))
    if thermo is None:
        thermo = _still_whole(case, directory)
    return FinishedRun(
        case=case,
        directory=directory,
        thermo=thermo,
        ranks=state["ranks"],
        wall_s=state["wall_s"],
        cpu_s=state.get("cpu_s"),
        command=tuple(state["command"]),
        engine=state["engine"],
        parts=state["parts"],
        reused=reused,
        begun_again=state.get("begun_again"),
    )


def _still_whole(case: Case, directory: RunDirectory) -> Thermo:
    """The log of a run that was proven whole; its data are proven again, for files get lost."""
    try:
        thermo = read_logs(directory)
        faults = missing_data(case, directory, thermo)
    except ParseError as error:
        faults = [str(error)]
    if faults:
        raise RunFolderError(
            f"{directory.path}: the run in it was finished, but what it wrote is not whole any "
            f"more: {'; '.join(faults)}; move the folder away and run the scene again"
        )
    return thermo
