"""The hard cases broken on purpose: whether what is wrong is caught, by what, and how it is named.

A sabotage alters a case after all that is checked before a run. What is left to catch it are the
watch over the run, the engine itself, the verdict, and the invariants of the study.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Literal

import numpy as np

from liggghts_driver.deck.build import build_deck
from liggghts_driver.errors import SceneError
from liggghts_driver.identity import scene_hash
from liggghts_driver.prepare import prepare
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.studies.departure import departure
from liggghts_driver.studies.energy import read_ran
from liggghts_driver.studies.invariants import changed_by, hardest, invariants_of
from liggghts_driver.studies.sabotage import sabotages_of
from liggghts_driver.studies.stability import FINE, task_at
from liggghts_driver.studies.tasks import run_folder, task_of
from liggghts_driver.sweeps.work import is_done

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from liggghts_driver.scene.model import Scene
    from liggghts_driver.studies.energy import Ran
    from liggghts_driver.studies.sabotage import Sabotage
    from liggghts_driver.studies.stability import Run, Studied
    from liggghts_driver.sweeps.task import Task

    Array = NDArray[np.float64]

Fate = Literal["caught", "no difference", "harmless", "not caught", "not run"]
#: Who caught it: the driver before the engine is launched, the watch over the run, the engine (or
#: the proofs that its run is whole), the verdict on a whole run, an invariant that the run breaks
#: by itself, or the comparison with the sound run.
Line = Literal["refusal", "watch", "engine", "verdict", "invariant", "comparison", ""]

#: Two runs are the same where no body is further apart than this, in radii of the smallest sphere:
#: the rounding of 1e5 steps.
_SAME = 1e-9


@dataclass(frozen=True)
class Broken:
    """What became of a case that was broken on purpose.

    Attributes
    ----------
    by
        What caught it; empty where nothing did.
    sentence
        What it said; or why there is nothing to be caught.
    apart
        How far a body is from where it is in the sound run, at most, in radii of the smallest
        sphere; nan where the run did not end.
    """

    case: str
    sabotage: str
    fate: Fate
    by: Line = ""
    sentence: str = ""
    apart: float = math.nan

    @property
    def hides(self) -> bool:
        """Whether something is wrong and nothing tells."""
        return self.fate in ("not caught", "not run")


@dataclass(frozen=True)
class Plan:
    """A sabotage to be tried.

    Attributes
    ----------
    sound, fine
        The runs of the case as it is, and with half its step.
    task
        The broken run; None where the driver refuses to write its deck.
    refusal
        Why it does.
    """

    case: str
    sabotage: Sabotage
    sound: Task
    fine: Task
    task: Task | None
    refusal: str = ""


def plans_of(
    name: str, scene: Scene, runs: Path, wanted: Callable[[str], bool] = bool
) -> Iterator[Plan]:
    """All that is to be tried of a case, each in a folder of its own beside that of the sound run.

    Parameters
    ----------
    name
        Of the case.
    scene
        Its scene.
    runs
        The folder of all runs.
    wanted
        Tells by the name of a sabotage whether it is to be tried; by default each is.
    """
    case, sound = prepare(scene), task_of(name, scene, run_folder(scene, runs))
    fine = task_at(name, scene, case.time.step_s, FINE, runs)
    for sabotage in sabotages_of(name, case):
        if not wanted(sabotage.name):
            continue
        try:
            files = build_deck(sabotage.alter(case), scene_hash(case.identity)).files
        except SceneError as error:
            yield Plan(name, sabotage, sound, fine, None, str(error))
            continue
        # Another version's deck is another run.
        digest = hashlib.sha256("".join(files.values()).encode()).hexdigest()[:8]
        folder = runs / f"{name}-{sabotage.name.replace(' ', '-')}-{digest}"
        title = f"{name}, {sabotage.name}"
        yield Plan(name, sabotage, sound, fine, task_of(title, scene, folder, sabotage.alter))


def study_broken(studied: Sequence[Studied], runs: Path, run: Run) -> list[Broken]:
    """Break every case that holds, in every way.

    Parameters
    ----------
    studied
        The cases, tried at their own settings. What does not hold there is caught as it is.
    runs
        The folder of all runs, the sound ones among them.
    run
        Runs tasks, whatever becomes of them.
    """
    plans: list[Plan] = []
    for each in studied:
        if each.case.expected == "holds" and each.own is not None and each.own.holds:
            assert each.scene is not None
            plans += plans_of(each.case.name, each.scene, runs)
    return try_out(plans, run)


def try_out(plans: Iterable[Plan], run: Run) -> list[Broken]:
    """Run what is to be tried, and what is sound where it was not yet and is needed; judge it."""
    plans = list(plans)
    run([plan.task for plan in plans if plan.task is not None])
    whole = [plan for plan in plans if plan.task is not None and is_done(plan.task.folder)]
    run(_each_once(plan.sound for plan in whole))
    read = lru_cache(maxsize=2)(read_ran)  # those of one case: they are large
    found = [_judged(plan, partial(read, plan.sound.folder)) for plan in plans]
    # Only where all else is silent half the step is needed.
    silent = {n: plans[n] for n, each in enumerate(found) if each.fate == "not caught"}
    run(_each_once(plan.fine for plan in silent.values()))
    for number, plan in silent.items():
        found[number] = _compared(found[number], plan, read)
    return found


def _each_once(tasks: Iterable[Task]) -> list[Task]:
    return list({task.folder: task for task in tasks}.values())


def _compared(silent: Broken, plan: Plan, read: Callable[[Path], Ran]) -> Broken:
    """What is caught by its departure from the sound run, which half the step does not explain."""
    assert plan.task is not None
    if not is_done(plan.fine.folder):
        return silent
    ran, sound, fine = (read(task.folder) for task in (plan.task, plan.sound, plan.fine))
    found = departure(ran, sound, fine)
    if not found.broken:
        return silent
    return replace(silent, fate="caught", by="comparison", sentence=found.sentence)


def _judged(plan: Plan, sound: Callable[[], Ran]) -> Broken:
    begun = Broken(plan.case, plan.sabotage.name, "not run", sentence="its run did not end")
    if plan.task is None:
        return replace(begun, fate="caught", by="refusal", sentence=plan.refusal)
    if not is_done(plan.task.folder):
        return of_failure(begun, RunDirectory(plan.task.folder))
    ran = read_ran(plan.task.folder)
    begun = replace(begun, apart=largest_distance(ran, sound()))
    by, sentence = what_caught(ran, sound())
    if by:
        return replace(begun, fate="caught", by=by, sentence=sentence)
    return of_silence(begun, plan.sabotage)


def of_failure(begun: Broken, run: RunDirectory) -> Broken:
    """What became of it where its run failed: who ended it, and in which words."""
    state = run.read_state()
    if state["state"] != "failed":
        return begun
    by: Line = "watch" if run.deck.exists() else "refusal"
    if "returncode" in state:
        by = "engine"
    return replace(begun, fate="caught", by=by, sentence=str(state["faults"][0]))


def of_silence(begun: Broken, sabotage: Sabotage) -> Broken:
    """What became of it where nothing says that the run is wrong."""
    if begun.apart <= _SAME:
        return replace(begun, fate="no difference", sentence="everything goes the same way")
    if sabotage.harmless and begun.apart <= sabotage.at_most:
        return replace(begun, fate="harmless", sentence=sabotage.harmless)
    sentence = f"bodies are up to {begun.apart:.2g} radii off their way, and nothing says so"
    return replace(begun, fate="not caught", sentence=sentence)


def what_caught(ran: Ran, sound: Ran) -> tuple[Line, str]:
    """What says first that a whole run is wrong, and its words; nothing where all is silent."""
    if ran.results["verdict"] == "invalid":
        return "verdict", str(ran.results["reasons"][0])
    worst = hardest(invariants_of(ran))
    if worst.broken:
        return "invariant", worst.sentence
    changed = replace(changed_by(ran, sound), name="change from the sound run")
    return ("comparison", changed.sentence) if changed.broken else ("", "")


def largest_distance(ran: Ran, sound: Ran) -> float:
    """How far any body is from where it is in another run, at most, in radii of the smallest."""
    radius = float(sound.case.population.radii_m.min())
    until_s = min(float(ran.times_s[-1]), float(sound.times_s[-1]))
    times = ran.times_s[ran.times_s <= until_s]
    apart = ran.positions_m[: len(times)] - sound.places_at(times)
    found = float(np.linalg.norm(apart, axis=2).max(initial=0.0))
    if sound.case.scene.piston is not None:
        found = max(found, float(np.abs(_piston_at(times, ran) - _piston_at(times, sound)).max()))
    return found / radius


def _piston_at(times_s: Array, ran: Ran) -> Array:
    times, places = (ran.series[name].to_numpy() for name in ("time_s", "piston_x_m"))
    return np.asarray(np.interp(times_s, times, places))
