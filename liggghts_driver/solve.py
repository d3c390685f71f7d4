"""The main job: a scene becomes a checked answer in a run directory."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from liggghts_driver.deck.build import build_deck
from liggghts_driver.errors import RunFolderError, SceneError
from liggghts_driver.identity import scene_hash
from liggghts_driver.outputs import write_text
from liggghts_driver.prepare import prepare
from liggghts_driver.results.answer import Answer, analyse
from liggghts_driver.run import finished_run, run_case
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.written import require_same_deck, write_deck

if TYPE_CHECKING:
    from collections.abc import Callable

    import pandas as pd

    from liggghts_driver.case import Case
    from liggghts_driver.engine.stop import Stop
    from liggghts_driver.run import FinishedRun
    from liggghts_driver.scene.model import Scene


@dataclass(frozen=True)
class Solution:
    """An answer and where it stands; ``reused`` when the run was found finished."""

    case: Case
    answer: Answer
    directory: RunDirectory
    reused: bool

    @property
    def series(self) -> pd.DataFrame:
        """The time series; what ``series.csv`` holds."""
        return self.answer.series

    @property
    def results(self) -> dict[str, Any]:
        """What ``results.json`` holds."""
        return self.answer.results


def default_directory(scene: Scene, name: str) -> Path:
    """``runs/<name>-<hash>``: one folder for each scene."""
    return Path("runs") / f"{name}-{scene_hash(scene)[:8]}"


def solve(
    scene: Scene,
    out: str | Path,
    ranks: int = 1,
    on_case: Callable[[Case], None] = lambda _case: None,
    on_step: Callable[[int], None] = lambda _step: None,
    stop: Stop | None = None,
    *,
    on_note: Callable[[str], None] = lambda _note: None,
    report: bool = True,
    alter: Callable[[Case], Case] | None = None,
) -> Solution:
    """Place the spheres, run the engine, analyse and report.

    Parameters
    ----------
    scene
        What to solve.
    out
        The run directory: absent, empty, or one that holds this scene already.
    ranks
        MPI processes.
    on_case
        Called when everything before the engine is done.
    on_step
        Called with each step that the engine reports.
    stop
        The wish that the run end at its next checkpoint, which signals express too.
    on_note
        Called with what a user should know while it runs: that it begins again, and why.
    report
        Whether ``report.html`` is written now; ``load`` can write it later.
    alter
        Makes another case of the one that was checked, for studies of what is caught when the run
        is not what the scene asked for.

    Raises
    ------
    DriverError
        Of the class of what failed; the run directory keeps everything.
    RunInterrupted
        If the run was asked to end, and did at a checkpoint.
    """
    if not isinstance(ranks, int) or ranks < 1:
        raise SceneError(f"ranks = {ranks!r}: must be a whole number of at least 1")
    directory = RunDirectory(Path(out))
    directory.claim_for(scene)
    start = time.perf_counter()
    case = prepare(scene)
    if alter is not None:
        case = alter(case)
    placing = time.perf_counter() - start
    on_case(case)
    run = run_case(case, directory, ranks, on_step, stop, on_note)
    return _conclude(run, {"place_spheres_s": placing}, report=report)


def load(path: str | Path) -> Solution:
    """Analyse a finished run again, and write its report again.

    Raises
    ------
    RunFolderError
        If the folder holds no finished run.
    """
    directory = RunDirectory(Path(path))
    scene = directory.read_scene()
    state = directory.read_state()
    if state["state"] != "complete":
        raise RunFolderError(f"{path}: {_no_answer(state)}")
    case = prepare(scene)
    run = finished_run(case, directory, reused=True)
    require_same_deck(case, directory, scene_hash(scene))
    return _conclude(run, {}, report=True)


def _no_answer(state: dict[str, Any]) -> str:
    """Why a run has no answer, and what is to be done about it."""
    if state["state"] != "failed":
        return f"the run in it is {state['state']}; run it again first"
    faults = "; ".join(str(fault) for fault in state.get("faults", ()))
    if state.get("diagnosis"):
        return f"the run in it was stopped and has no answer: {faults}"
    return f"the run in it failed: {faults}; the command that ran it tries it again"


def write_only(scene: Scene, out: str | Path, ranks: int = 1) -> RunDirectory:
    """Write the deck and all that it reads, and run nothing.

    Raises
    ------
    RunFolderError
        If the folder holds anything already.
    """
    directory = RunDirectory(Path(out))
    if not directory.make_or_find_empty():
        raise RunFolderError(f"{out}: is not empty; choose another folder with --out")
    case = prepare(scene)
    write_deck(case, build_deck(case, scene_hash(scene), ranks), directory)
    return directory


def _conclude(run: FinishedRun, parts: dict[str, float], *, report: bool) -> Solution:
    start = time.perf_counter()
    answer = analyse(run)
    directory = run.directory
    answer.results["cost"]["parts"] |= {
        **parts,
        "engine_s": run.wall_s,
        "analyse_s": time.perf_counter() - start,
    }
    write_text(directory.series, answer.series.to_csv(index=False))
    write_text(directory.results, json.dumps(answer.results, indent=2, allow_nan=False) + "\n")
    if report:
        from liggghts_driver.report.write import write_report

        write_report(run.case, answer, directory)
    return Solution(run.case, answer, directory, run.reused)
