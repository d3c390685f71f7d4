"""Scenes as plain tables, run by the real engine; and the little mathematics the tests share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from liggghts_driver.case import Case, make_case
from liggghts_driver.results.positions import Instant, iter_instants
from liggghts_driver.results.series import complete_series, read_series
from liggghts_driver.run import run_case
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.scene import make_scene

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd
    from numpy.typing import ArrayLike, NDArray

Tables = dict[str, Any]


@dataclass(frozen=True)
class Outcome:
    """A finished run: its frames in the order of time, and its series in our columns."""

    case: Case
    directory: RunDirectory
    instants: list[Instant]
    series: pd.DataFrame

    @property
    def times_s(self) -> NDArray[np.float64]:
        """Times of the frames."""
        return np.array([instant.step for instant in self.instants]) * self.case.time.step_s

    @property
    def positions_m(self) -> NDArray[np.float64]:
        """``(frames, particles, 3)``."""
        return np.array([instant.positions_m for instant in self.instants])

    @property
    def velocities_m_s(self) -> NDArray[np.float64]:
        """``(frames, particles, 3)``."""
        return np.array([instant.velocities_m_s for instant in self.instants])


def run_scene(tables: Tables, folder: Path, ranks: int = 1) -> Outcome:
    """Read, place, write, run and load: what the command line does, without its report."""
    case = make_case(make_scene(tables))
    directory = RunDirectory(folder)
    run_case(case, directory, ranks)
    raw = read_series(directory.engine_series)
    return Outcome(case, directory, list(iter_instants(directory)), complete_series(raw, case))


def stepping(step_s: float, steps: int, frames: int = 10) -> Tables:
    """Tables [time] and [output] for a run of so many steps, with a row for each frame.

    ``frames`` must divide ``steps``, so that the last frame is that of the last step. The step
    may be as long as a whole contact: these tests choose it themselves.
    """
    assert steps % frames == 0
    assert frames >= 10
    return {
        "time": {"duration": step_s * steps, "step": step_s, "step_fraction": 1.0},
        "output": {"samples": frames, "frames": frames, "images": 0},
    }


def order(steps: ArrayLike, errors: ArrayLike) -> NDArray[np.float64]:
    """Exponent p of errors ~ steps^p by least squares in the logarithms.

    ``errors`` is ``(len(steps), ...)``; one exponent for each of the other dimensions.
    """
    x = np.log(np.asarray(steps, dtype=float))
    y = np.log(np.asarray(errors, dtype=float)).reshape(len(x), -1)
    slopes: NDArray[np.float64] = np.polyfit(x, y, 1)[0]
    return slopes
