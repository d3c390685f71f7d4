"""What the engine has written since it was last looked at, and only what is whole."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.deck.build import FRAME_COLUMNS
from liggghts_driver.errors import ParseError
from liggghts_driver.results.binarydump import iter_binary_frames
from liggghts_driver.results.series import read_row
from liggghts_driver.timestep import frame_steps

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from liggghts_driver.case import Case
    from liggghts_driver.rundir import RunDirectory

Row = dict[str, float]


class SeriesTail:
    """New rows of the series; the file is read from where it was left."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._read_bytes = 0
        self._names: list[str] = []

    def new_rows(self) -> list[Row]:
        """Complete rows that came since the last call; none while there is no file.

        A line that is no row is passed over: what reads the whole file will name it.
        """
        rows = []
        for line in self._new_lines():
            if not self._names:
                self._names = line.split()
                continue
            with contextlib.suppress(ValueError):
                rows.append(dict(zip(self._names, read_row(line, self._names), strict=True)))
        return rows

    def _new_lines(self) -> list[str]:
        try:
            if self._path.stat().st_size <= self._read_bytes:
                return []
            with self._path.open("rb") as file:
                file.seek(self._read_bytes)
                complete, newline, _ = file.read().rpartition(b"\n")
        except FileNotFoundError:
            return []
        self._read_bytes += len(complete) + len(newline)
        return complete.decode("utf-8", errors="replace").splitlines()


def read_rows(part: RunDirectory) -> list[Row]:
    """Every complete row of a part of a run."""
    return SeriesTail(part.engine_series).new_rows()


@dataclass(frozen=True)
class Snapshot:
    """The particles of a frame, in the order of their ids.

    ``rows`` are those of the population, an id less one; one that is missing is lost.
    """

    step: int
    rows: NDArray[np.int64]
    positions_m: NDArray[np.float64]
    velocities_m_s: NDArray[np.float64]

    @property
    def speeds_m_s(self) -> NDArray[np.float64]:
        """``(n,)``."""
        speeds: NDArray[np.float64] = np.linalg.norm(self.velocities_m_s, axis=1)
        return speeds

    @property
    def finite(self) -> NDArray[np.bool_]:
        """Which particles have a place and a velocity that are numbers."""
        numbers = np.hstack([self.positions_m, self.velocities_m_s])
        return np.asarray(np.isfinite(numbers).all(axis=1))


class FrameTail:
    """The newest whole frame of a launch.

    Their names are known beforehand, so that no folder is listed. Of several new ones only the
    last is read: the others are looked at after the run.
    """

    def __init__(self, case: Case, run: RunDirectory) -> None:
        begun = case.checkpoint.step if case.checkpoint else 0
        steps = [step for step in frame_steps(case.time) if step >= begun]
        self._ahead = [(step, run.dumps / f"particles.{step:010d}.bin") for step in steps]
        self._run = run
        self.last: Snapshot | None = None

    def newest(self) -> Snapshot | None:
        """The newest frame if it is whole and was not handed out before."""
        there = 0
        while there < len(self._ahead) and self._ahead[there][1].exists():
            there += 1
        for number in reversed(range(there)):
            snapshot = read_snapshot(self._ahead[number][1])
            if snapshot is not None:
                del self._ahead[: number + 1]
                self.last = snapshot
                return snapshot
        return None

    def before(self, step: int) -> Snapshot | None:
        """The last whole frame before a step, of this launch or an earlier one; None without."""
        for path in reversed(self._run.frame_files()):
            if self._run.step_of(path) < step and (found := read_snapshot(path)) is not None:
                return found
        return None


def read_snapshot(path: Path) -> Snapshot | None:
    """The frame in a file; None while it is not whole."""
    try:
        frames = list(iter_binary_frames(path, FRAME_COLUMNS))
    except ParseError:
        return None
    if not frames:
        return None
    data = frames[0].data.sort_values("id")
    return Snapshot(
        step=frames[0].step,
        rows=data["id"].to_numpy() - 1,
        positions_m=data[["x", "y", "z"]].to_numpy(),
        velocities_m_s=data[["vx", "vy", "vz"]].to_numpy(),
    )
