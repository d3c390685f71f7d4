"""Run a case in a directory: write the deck, launch the engine, prove that it finished."""

from __future__ import annotations

import os
import platform
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from liggghts_driver.deck.build import build_deck
from liggghts_driver.engine.completion import missing_proofs
from liggghts_driver.engine.diagnose import failure_message
from liggghts_driver.engine.find import find_engine
from liggghts_driver.engine.launch import Launch, launch
from liggghts_driver.errors import RunError, RunFolderError
from liggghts_driver.results.thermo import Thermo, read_thermo
from liggghts_driver.rundir import RunDirectory, scene_hash, write_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from liggghts_driver.case import Case
    from liggghts_driver.deck.build import Deck


#: What of the time plan a run keeps, so that a later version of this software reads it right.
_PLAN = ("step_s", "steps", "sample_every", "refresh_every", "frame_every", "image_every")


#: The engine's split is believed when it tells of this share of the stepping.
_TOLD = 0.9


@dataclass(frozen=True)
class FinishedRun:
    """A run that is proven complete.

    ``reused`` tells that it was found finished and nothing was computed.
    """

    case: Case
    directory: RunDirectory
    thermo: Thermo
    ranks: int
    wall_s: float
    command: tuple[str, ...]
    engine: str
    parts: dict[str, float]
    reused: bool


def run_case(
    case: Case,
    directory: RunDirectory,
    ranks: int = 1,
    on_step: Callable[[int], None] = lambda _step: None,
) -> FinishedRun:
    """Run a case, or find it finished.

    Parameters
    ----------
    case
        What to run.
    directory
        Where: an absent or empty folder, or one that holds this very scene. What an earlier
        unfinished attempt left there is moved aside, never overwritten.
    ranks
        MPI processes.
    on_step
        Called with each step that the engine reports.

    Raises
    ------
    RunFolderError
        If the folder holds anything else.
    EngineNotFoundError
        If the engine or a launcher is missing.
    RunError
        If the engine failed or its run is not whole; the folder stays.
    """
    directory.claim_for(case.identity)
    identity = scene_hash(case.identity)
    state = directory.read_state()
    if state["state"] == "complete":
        require_same_deck(case, directory, identity)
        return finished_run(case, directory, reused=True)
    _require_nobody_there(directory, state)
    engine = find_engine()
    command = engine.command(ranks)
    deck = build_deck(case, identity, ranks)
    directory.set_aside()
    write_deck(case, deck, directory)
    facts = {
        "scene_hash": identity,
        "ranks": ranks,
        "command": command,
        "engine": engine.version,
        "host": platform.node(),
        "pid": os.getpid(),
        "time": {name: getattr(case.time, name) for name in _PLAN},
        "started": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
    }
    directory.write_state(state="running", **facts)
    ended = _launch(command, directory, on_step, facts)
    thermo = _read_log(directory)
    faults = missing_proofs(case, deck.sentinel, directory, thermo, ended.returncode)
    outcome = {
        **facts,
        "wall_s": ended.wall_s,
        "returncode": ended.returncode,
        "parts": _engine_parts(thermo),
    }
    if faults:
        directory.write_state(state="failed", **outcome, faults=faults)
        raise RunError(failure_message(directory, faults))
    directory.write_state(state="complete", **outcome)
    return finished_run(case, directory, reused=False, thermo=thermo)


def _engine_parts(thermo: Thermo) -> dict[str, float]:
    """The engine's own split of its time, where it tells of nearly all of it; else nothing.

    A run that renews something in between is told in pieces that the engine does not split.
    """
    told, taken = sum(thermo.timing_s.values()), sum(loop.seconds for loop in thermo.loops)
    if told < _TOLD * taken:
        return {}
    return {f"engine_{name.lower()}_s": seconds for name, seconds in thermo.timing_s.items()}


def write_deck(case: Case, deck: Deck, directory: RunDirectory) -> None:
    """Write everything that the engine reads, and the scene it came from."""
    directory.dumps.mkdir(parents=True, exist_ok=True)
    directory.write_scene(case.identity)
    for name, text in deck.files.items():
        write_text(directory.path / name, text)


def require_same_deck(case: Case, directory: RunDirectory, identity: str) -> None:
    """Refuse to pass off an older version's run as what this version would compute.

    Raises
    ------
    RunFolderError
        If a file that the engine read is not what this version would write.
    """
    ranks = directory.read_state().get("ranks", 1)
    for name, text in build_deck(case, identity, ranks).files.items():
        path = directory.path / name
        if path.exists() and _commands(path.read_text(encoding="utf-8")) == _commands(text):
            continue
        raise RunFolderError(
            f"{directory.path}: holds a finished run of this scene, but its {name} is not what "
            "this version of the software would write; choose another folder with --out"
        )


def _commands(deck: str) -> list[str]:
    """A deck without its comments, in which a title may have changed."""
    lines = (line.partition("#")[0].rstrip() for line in deck.splitlines())
    return [line for line in lines if line]


def _require_nobody_there(directory: RunDirectory, state: dict[str, Any]) -> None:
    """Refuse a folder in which a run is going on."""
    if state["state"] != "running":
        return
    host, pid = state.get("host"), state.get("pid")
    if host != platform.node():
        raise RunFolderError(
            f"{directory.path}: a run was started here on {host}; if it is not running any more, "
            f"delete {directory.state.name}, or choose another folder with --out"
        )
    if isinstance(pid, int) and Path(f"/proc/{pid}").exists():
        raise RunFolderError(
            f"{directory.path}: a run is going on here (process {pid}); wait for it, or choose "
            "another folder with --out"
        )


def _read_log(directory: RunDirectory) -> Thermo:
    """The engine's log; what it printed, where it died before it opened one."""
    return read_thermo(directory.log if directory.log.exists() else directory.stdout)


def _launch(
    command: list[str],
    directory: RunDirectory,
    on_step: Callable[[int], None],
    facts: dict[str, object],
) -> Launch:
    try:
        return launch(command, directory.path, directory.stdout, on_step)
    except BaseException as error:
        interrupted = isinstance(error, KeyboardInterrupt)
        directory.write_state(state="interrupted" if interrupted else "failed", **facts)
        raise


def finished_run(
    case: Case, directory: RunDirectory, *, reused: bool, thermo: Thermo | None = None
) -> FinishedRun:
    """What is known of a run that is complete on disk; its log is read where it was not yet.

    Raises
    ------
    RunFolderError
        If the run was recorded by a version of this software that kept less of it.
    """
    state = directory.read_state()
    missing = {"time", "ranks", "wall_s", "command", "engine", "parts"} - state.keys()
    if missing:
        raise RunFolderError(
            f"{directory.state}: does not tell {', '.join(sorted(missing))}; it was written by "
            "another version of this software, run the scene again in another folder"
        )
    return FinishedRun(
        case=replace(case, time=replace(case.time, **state["time"])),
        directory=directory,
        thermo=thermo or read_thermo(directory.log),
        ranks=state["ranks"],
        wall_s=state["wall_s"],
        command=tuple(state["command"]),
        engine=state["engine"],
        parts=state["parts"],
        reused=reused,
    )
