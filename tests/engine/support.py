"""Scenes as plain tables, run by the real engine; and the little mathematics the tests share."""

from __future__ import annotations

import itertools
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from liggghts_driver.case import Case, make_case
from liggghts_driver.results.positions import read_frames
from liggghts_driver.results.series import complete_series, read_series
from liggghts_driver.run import run_case
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.scene import make_scene

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    import pandas as pd
    from numpy.typing import ArrayLike, NDArray

#: What `tomllib` would give for a scene file.
Tables = dict[str, Any]

#: The engine waits most of its first third of a second for MPI: runs side by side share the wait.
_SIDE_BY_SIDE = 8


@dataclass(frozen=True)
class Outcome:
    """A finished run: its frames, and its series in the package's columns.

    Attributes
    ----------
    times_s
        ``(frames,)``, from the start on.
    positions_m, velocities_m_s
        ``(frames, particles, 3)``; particles in the order of the scene, fixed grains left out.
    """

    case: Case
    directory: RunDirectory
    series: pd.DataFrame
    times_s: NDArray[np.float64]
    positions_m: NDArray[np.float64]
    velocities_m_s: NDArray[np.float64]


class Simulator:
    """Runs scenes, each in a new folder below one root."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self._numbers = itertools.count()

    def run(self, tables: Tables, ranks: int = 1) -> Outcome:
        """Read, place, write, run and load: what the command line does, without its report."""
        case = make_case(make_scene(tables))
        directory = RunDirectory(self._root / f"run-{next(self._numbers)}")
        run_case(case, directory, ranks)
        frames = read_frames(directory)
        return Outcome(
            case=case,
            directory=directory,
            series=complete_series(read_series(directory.engine_series), case),
            times_s=frames.steps * case.time.step_s,
            positions_m=frames.positions_m,
            velocities_m_s=frames.velocities_m_s,
        )

    def run_all(self, scenes: Sequence[Tables]) -> list[Outcome]:
        """Run scenes side by side; the outcomes in their order."""
        with ThreadPoolExecutor(_SIDE_BY_SIDE) as pool:
            return list(pool.map(self.run, scenes))


def stepping(step_s: float, steps: int, frames: int = 10) -> Tables:
    """Tables [time] and [output]: so many steps, with a row of the series for each frame.

    ``frames``, at least 10, must divide ``steps``, so that the last frame is that of the last
    step. The step may be as long as a whole contact: these tests choose it themselves.
    """
    assert steps % frames == 0
    return {
        "time": {"duration": step_s * steps, "step": step_s, "step_fraction": 1.0},
        "output": {"samples": frames, "frames": frames, "images": 0},
    }


def order(steps: ArrayLike, errors: ArrayLike) -> NDArray[np.float64]:
    """Exponent p of errors ~ steps^p by least squares in the logarithms.

    ``errors`` is ``(len(steps), n)`` or ``(len(steps),)``; one exponent for each column.
    """
    x = np.log(np.asarray(steps, dtype=float))
    y = np.log(np.asarray(errors, dtype=float)).reshape(len(x), -1)
    exponents: NDArray[np.float64] = np.polyfit(x, y, 1)[0]
    return exponents
