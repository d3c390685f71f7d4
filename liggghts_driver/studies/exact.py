"""Problems whose exact answer is known: what an error costs, and the order in which it falls."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from liggghts_driver.results.positions import read_frames
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.studies.tasks import core_s, run_folder, task_of
from liggghts_driver.sweeps.work import is_done

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from numpy.typing import ArrayLike, NDArray

    from liggghts_driver.scene.model import Scene
    from liggghts_driver.sweeps.task import Task

#: What the horizontal axis is called where costs are measured.
CORE_TIME = "core time of stepping [s]"


@dataclass(frozen=True)
class Moved:
    """What a finished run says: its steps, what it cost, and how the spheres moved.

    Attributes
    ----------
    core_s
        Processor time of the engine, its start included.
    times_s
        ``(frames,)``, from the start on.
    positions_m, velocities_m_s
        ``(frames, spheres, 3)`` in the order of the scene.
    series
        Columns as ``series.csv`` has them.
    """

    step_s: float
    steps: int
    refresh_every: int
    core_s: float
    times_s: NDArray[np.float64]
    positions_m: NDArray[np.float64]
    velocities_m_s: NDArray[np.float64]
    series: pd.DataFrame


@dataclass(frozen=True)
class Expected:
    """What is known of an error beforehand: it goes with the knob to the power ``order``.

    Attributes
    ----------
    quantity
        Whose error it is, for people.
    order
        The exponent.
    within
        How far a fit over a few values may be from it: what the next term of the error does.
    why
        One sentence.
    """

    quantity: str
    order: float
    within: float
    why: str


@dataclass(frozen=True)
class Trial:
    """One value of a knob.

    Attributes
    ----------
    value
        Where the knob stands.
    scene
        The problem simulated with it.
    errors
        From a finished run, the error of each quantity.
    steps
        The cost as a number of steps; None where it is measured.
    """

    value: float
    scene: Scene
    errors: Callable[[Moved], Mapping[str, float]]
    steps: float | None = None


@dataclass(frozen=True)
class Knob:
    """One knob of a problem, turned; the trials go from the finest to the coarsest.

    Attributes
    ----------
    title
        What tells its lines from those of the problem's other knobs; may be empty.
    name
        What is turned, and over what it is measured.
    """

    title: str
    name: str
    trials: tuple[Trial, ...]
    expected: tuple[Expected, ...]

    @property
    def word(self) -> str:
        """What is turned, in a word."""
        return self.name.split(" ")[0]


@dataclass(frozen=True)
class Problem:
    """A problem with an exact answer.

    Attributes
    ----------
    cost
        What the cost is, with its unit.
    start
        A scene like the others that hardly steps: what an engine costs before it does.
    """

    name: str
    title: str
    cost: str
    knobs: tuple[Knob, ...]
    start: Scene | None = None


@dataclass(frozen=True)
class Measured:
    """The errors of one quantity against one knob, the finest first."""

    problem: Problem
    knob: Knob
    expected: Expected
    knob_values: tuple[float, ...]
    errors: tuple[float, ...]
    costs: tuple[float, ...]
    runs: tuple[Moved, ...]

    @property
    def title(self) -> str:
        """Quantity and knob, as far as they need telling."""
        return ", ".join(part for part in (self.knob.title, self.expected.quantity) if part)

    @property
    def order(self) -> float:
        """The fitted exponent; nan where too little is known."""
        return fitted_order(self.knob_values, self.errors)

    @property
    def is_right(self) -> bool:
        """Whether the fit is as near to what is expected as it must be."""
        return abs(self.order - self.expected.order) <= self.expected.within


def fitted_order(values: ArrayLike, errors: ArrayLike) -> float:
    """Exponent p of errors ~ values^p by least squares in the logarithms.

    It is nan with fewer than two values, and where an error is not a positive number.
    """
    x, y = np.asarray(values, dtype=float), np.asarray(errors, dtype=float)
    if len(x) < 2 or not np.all(np.isfinite(y) & (y > 0.0)):
        return math.nan
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def tasks_of(problems: Sequence[Problem], runs: Path) -> list[Task]:
    """A run for each scene of the problems; one that two problems have is run once."""
    tasks: dict[Path, Task] = {}
    for problem in problems:
        for name, scene in _scenes(problem).items():
            folder = run_folder(scene, runs)
            tasks.setdefault(folder, task_of(f"{problem.title}, {name}", scene, folder))
    return list(tasks.values())


def measure(problems: Sequence[Problem], runs: Path) -> list[Measured]:
    """What the finished runs say of every quantity of every problem."""
    found = []
    for problem in problems:
        start = None if problem.start is None else _read(problem.start, runs)
        for knob in problem.knobs:
            found += _measured(problem, knob, runs, start.core_s if start else 0.0)
    return found


def _scenes(problem: Problem) -> dict[str, Scene]:
    found = {} if problem.start is None else {"start": problem.start}
    for knob in problem.knobs:
        for trial in knob.trials:
            found[f"{knob.title or 'at'} {knob.name} {trial.value:.3g}"] = trial.scene
    return found


def _read(scene: Scene, runs: Path) -> Moved | None:
    """The finished run of a scene, if it is finished."""
    folder = run_folder(scene, runs)
    if not is_done(folder):
        return None
    run = RunDirectory(folder)
    time, cost = run.read_state()["time"], json.loads(run.results.read_text("utf-8"))["cost"]
    frames = read_frames(run)
    return Moved(
        step_s=time["step_s"],
        steps=time["steps"],
        refresh_every=time["refresh_every"],
        core_s=core_s(cost),
        times_s=frames.steps * time["step_s"],
        positions_m=frames.positions_m,
        velocities_m_s=frames.velocities_m_s,
        series=pd.read_csv(run.series),
    )


def _measured(problem: Problem, knob: Knob, runs: Path, start_s: float) -> list[Measured]:
    read = [(trial, _read(trial.scene, runs)) for trial in knob.trials]
    known = [(trial, run, trial.errors(run)) for trial, run in read if run is not None]
    return [
        Measured(
            problem=problem,
            knob=knob,
            expected=expected,
            knob_values=tuple(trial.value for trial, _, _ in known),
            errors=tuple(errors[expected.quantity] for _, _, errors in known),
            costs=tuple(_cost(trial, run, start_s) for trial, run, _ in known),
            runs=tuple(run for _, run, _ in known),
        )
        for expected in knob.expected
    ]


def _cost(trial: Trial, run: Moved, start_s: float) -> float:
    if trial.steps is not None:
        return trial.steps
    return max(run.core_s - start_s, 0.0)
