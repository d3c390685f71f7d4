"""Whether hard cases hold, and by how much their steps can be multiplied before they break."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from liggghts_driver.case import make_case
from liggghts_driver.errors import PackingError, SceneError
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.scene import make_scene, read_scene
from liggghts_driver.studies.energy import read_ran
from liggghts_driver.studies.happenings import what_is_missing
from liggghts_driver.studies.invariants import Invariant, changed_by, hardest, invariants_of
from liggghts_driver.studies.restarted import restarted
from liggghts_driver.studies.tasks import first_fault, run_folder, task_of
from liggghts_driver.sweeps.work import is_done

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from liggghts_driver.scene.model import Scene
    from liggghts_driver.studies.energy import Ran
    from liggghts_driver.studies.hard_cases import HardCase
    from liggghts_driver.sweeps.task import Outcome, Task

    Run = Callable[[Sequence[Task]], Mapping[str, Outcome]]

#: Steps are tried up to this multiple of the chosen one.
LARGEST_FACTOR = 64.0
#: Halvings, in the logarithm, of the range between a factor that holds and the next that does not.
_BISECTIONS = 2
#: A run with half the step, beside which the others' answers are held.
FINE = 0.5


@dataclass(frozen=True)
class Trial:
    """A case tried with a multiple of its step.

    Attributes
    ----------
    invariants
        What a finished run says; empty without one.
    why
        What speaks against it, in a sentence; empty where all holds.
    refused
        Whether it was caught before the engine was launched.
    invalid
        Whether the driver itself says that there is no answer: by its verdict, or by a diagnosis of
        a run that failed.
    """

    factor: float
    invariants: tuple[Invariant, ...] = ()
    why: str = ""
    refused: bool = False
    invalid: bool = False

    @property
    def holds(self) -> bool:
        """Whether nothing speaks against it."""
        return not self.why

    @property
    def broken_by(self) -> str:
        """In a word or two: an invariant's name, refused, stopped or invalid; empty if it holds."""
        if self.holds or self.refused:
            return "refused" if self.refused else ""
        if not self.invariants:
            return "stopped"
        worst = hardest(self.invariants)
        return worst.name if worst.broken else "invalid"


@dataclass
class Studied:
    """A hard case as far as it is known."""

    case: HardCase
    scene: Scene | None = None
    step_s: float = math.nan
    own: Trial | None = None
    fine: Ran | None = None
    trials: list[Trial] = field(default_factory=list)

    @property
    def margin(self) -> float:
        """The largest multiple of the step that is known to hold, and none below breaks."""
        held = [trial.factor for trial in self.trials if trial.factor < self.breaks_at]
        return max(held, default=1.0)

    @property
    def first_broken(self) -> Trial | None:
        """The trial of the smallest multiple that does not hold."""
        broken = [trial for trial in self.trials if not trial.holds]
        return min(broken, key=lambda trial: trial.factor, default=None)

    @property
    def breaks_at(self) -> float:
        """The smallest multiple that is known not to hold; infinite where all do."""
        broken = self.first_broken
        return math.inf if broken is None else broken.factor

    @property
    def as_expected(self) -> bool:
        """Whether the case holds at its own settings, or is caught where it must be."""
        assert self.own is not None
        if self.case.expected == "refused":
            return self.own.refused
        if self.case.expected == "invalid":
            return self.own.invalid
        return self.own.holds

    def next_factor(self) -> float | None:
        """The multiple to try next; None when the margin is known well enough."""
        assert self.own is not None
        if not self.own.holds:
            return None
        if math.isinf(self.breaks_at):
            return 2.0 * self.margin if self.margin < LARGEST_FACTOR else None
        ratio = self.breaks_at / self.margin
        return math.sqrt(self.breaks_at * self.margin) if ratio > _finest() else None


def _finest() -> float:
    return float(2.0 ** (0.5**_BISECTIONS) * (1.0 + 1e-9))


def study_stability(
    cases: Sequence[HardCase], runs: Path, run: Run, *, margins: bool = True
) -> list[Studied]:
    """Try every case at its own settings and with half the step; then look for its margin.

    Parameters
    ----------
    cases
        What to try.
    runs
        The folder of all runs.
    run
        Runs tasks, whatever becomes of them.
    margins
        Whether larger steps are tried.
    """
    studied = [_begin(case) for case in cases]
    known = [each for each in studied if each.own is None]
    own = {each.case.name: _tasks(each, 1.0, runs) for each in known}
    fine = {each.case.name: _tasks(each, FINE, runs) for each in known}
    run([*(t for t in own.values() if t), *(t for t in fine.values() if t)])
    for each in known:
        task = fine[each.case.name]
        if task is not None and is_done(task.folder):
            each.fine = read_ran(task.folder)
        each.own = _own_trial(each, own[each.case.name], runs)
    while margins and _round(known, runs, run):
        pass
    return studied


def _round(known: Sequence[Studied], runs: Path, run: Run) -> bool:
    """Try one more multiple of each case that needs it; whether there was any."""
    wanted = [(each, factor) for each in known if (factor := each.next_factor()) is not None]
    tasks = [_tasks(each, factor, runs) for each, factor in wanted]
    run([task for task in tasks if task is not None])
    for (each, factor), task in zip(wanted, tasks, strict=True):
        each.trials.append(trial_of(task, factor, each) if task else _refusal(each, factor))
    return bool(wanted)


def _begin(case: HardCase) -> Studied:
    """A case whose scene is read and whose step is chosen, unless that is refused."""
    try:
        scene = read_scene(case.path)
        return Studied(case, scene, make_case(scene).time.step_s)
    except (SceneError, PackingError) as error:
        return Studied(case, own=Trial(1.0, why=first_fault(error), refused=True))


def scene_at(scene: Scene, step_s: float, factor: float) -> Scene:
    """A scene with a multiple of its step; what else would forbid such a step is relaxed.

    Raises
    ------
    SceneError
        If the step cannot be asked for at all.
    """
    if factor == 1.0:
        return scene
    tables = scene.model_dump(mode="json", exclude_none=True)
    step, duration = factor * step_s, scene.time.duration
    tables["time"] |= {"step": step, "step_fraction": 1.0}
    # A row of the series needs a step of its own.
    most = int(duration / step * (1.0 + 1e-9))
    for name in ("samples", "frames"):
        tables["output"][name] = min(tables["output"][name], most)
    return make_scene(tables, scene.title)


def _tasks(each: Studied, factor: float, runs: Path) -> Task | None:
    """The run of a case with a multiple of its step; None where the scene is refused."""
    assert each.scene is not None
    try:
        make_case(scene_at(each.scene, each.step_s, factor))
    except (SceneError, PackingError):
        return None
    return task_at(each.case.name, each.scene, each.step_s, factor, runs)


def task_at(name: str, scene: Scene, step_s: float, factor: float, runs: Path) -> Task:
    """The run of a scene with a multiple of its step.

    Raises
    ------
    SceneError
        If the step cannot be asked for at all.
    """
    changed = scene_at(scene, step_s, factor)
    return task_of(f"{name}, {factor:.3g} steps", changed, run_folder(changed, runs))


def _refusal(each: Studied, factor: float) -> Trial:
    assert each.scene is not None
    try:
        make_case(scene_at(each.scene, each.step_s, factor))
    except (SceneError, PackingError) as error:
        return Trial(factor, why=first_fault(error), refused=True)
    raise AssertionError("a scene that was refused is accepted now")


def trial_of(task: Task, factor: float, each: Studied) -> Trial:
    """What became of a run: its invariants, or why there are none."""
    if not is_done(task.folder):
        run = RunDirectory(task.folder)
        state = run.read_state()
        why = str((state.get("faults") or ["it did not end"])[0])
        return Trial(factor, (), why, not run.deck.exists(), "diagnosis" in state)
    return _trial_by(read_ran(task.folder), factor, each)


def _trial_by(ran: Ran, factor: float, each: Studied) -> Trial:
    invariants = invariants_of(ran)
    if each.fine is not None:
        invariants.append(changed_by(ran, each.fine))
    return judged(factor, invariants, ran.results)


def judged(factor: float, invariants: Sequence[Invariant], results: Mapping[str, object]) -> Trial:
    """A trial from its invariants and the verdict of its run."""
    worst = hardest(invariants)
    why = ""
    if worst.broken:
        why = worst.sentence
    elif results["verdict"] == "invalid":
        reasons = results["reasons"]
        assert isinstance(reasons, list)
        why = str(reasons[0])
    return Trial(factor, tuple(invariants), why, invalid=results["verdict"] == "invalid")


def _own_trial(each: Studied, task: Task | None, runs: Path) -> Trial:
    """What became of a run at its own step: it must be hard, too."""
    if task is None:
        return _refusal(each, 1.0)
    if not is_done(task.folder):
        return trial_of(task, 1.0, each)
    ran = read_ran(task.folder)
    trial = _trial_by(ran, 1.0, each)
    missing = what_is_missing(each.case.name, ran) if trial.holds else ""
    if missing:
        return replace(trial, why=f"it is not hard: {missing}")
    if not (each.case.restarts and trial.holds) or each.scene is None:
        return trial
    return judged(1.0, [*trial.invariants, *restarted(each.scene, ran, runs)], ran.results)
