"""What every reader of particle dumps hands out: frames, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import pandas as pd

from liggghts_driver.errors import ParseError

if TYPE_CHECKING:
    from numpy.typing import NDArray

PathLike: TypeAlias = str | Path
Paths: TypeAlias = PathLike | Iterable[PathLike]

INTEGER_COLUMNS = frozenset({"id", "type"})


@dataclass(frozen=True)
class Frame:
    """The particles at one step.

    Attributes
    ----------
    step : int
        Time step of the engine.
    box : ndarray, shape (3, 2)
        Lower and upper bound of the simulation box along x, y and z, in m.
    data : DataFrame
        One row per particle, in the order of the file, which changes from frame to frame. The
        columns are named as in the dump command, in the engine's units (SI); ``id`` and ``type``
        are int64, all others float64.
    """

    step: int
    box: NDArray[np.float64]
    data: pd.DataFrame

    def sorted_by_id(self) -> Frame:
        """Return the same frame with its rows in the order of the particles' ids."""
        order = np.argsort(self.data["id"].to_numpy())
        return replace(self, data=self.data.take(order).reset_index(drop=True))


@dataclass(frozen=True)
class Truncation:
    """The place where the last file ends inside a frame, as it does after a run was killed.

    Attributes
    ----------
    path : Path
        The file.
    where : str
        The line or byte at which the incomplete frame begins.
    missing : str
        What should have come where the file ends.
    """

    path: Path
    where: str
    missing: str

    def __str__(self) -> str:
        return f"{self.path}: the frame at {self.where} is cut off, missing {self.missing}"


class EndOfFileError(Exception):
    """A file ended inside a frame; the message says before what. Never leaves this package."""


FrameGenerator: TypeAlias = Generator[Frame, None, Truncation | None]


class FrameReader(Iterator[Frame]):
    """Iterator over the whole frames of one or several files.

    Attributes
    ----------
    truncated : Truncation or None
        Set once the iteration has ended: the incomplete frame at the end, if there is one. It was
        not handed out.
    """

    def __init__(self, frames: FrameGenerator) -> None:
        self._frames = frames
        self.truncated: Truncation | None = None

    def __next__(self) -> Frame:
        try:
            return next(self._frames)
        except StopIteration as stop:
            self.truncated = self.truncated or stop.value
            raise

    def first(self) -> Frame:
        """The next frame, for files with one.

        Raises
        ------
        ParseError
            If there is no whole frame.
        """
        found = next(self, None)
        if found is None:
            raise ParseError(str(self.truncated or "no file with a frame in it"))
        return found


def read_files(paths: Paths, read_one: Callable[[Path], FrameGenerator]) -> FrameReader:
    """Chain the frames of several files, of which only the last may be cut off.

    Parameters
    ----------
    paths : path or iterable of paths
        In the order of their steps.
    read_one : callable
        Generates the frames of one file and returns where it is cut off, or None.
    """
    files = [Path(paths)] if isinstance(paths, str | Path) else [Path(path) for path in paths]
    return FrameReader(_chain(files, read_one))


def _chain(files: list[Path], read_one: Callable[[Path], FrameGenerator]) -> FrameGenerator:
    truncated = None
    for path in files:
        if truncated:
            raise ParseError(f"{truncated}, though another file follows: {path}")
        try:
            truncated = yield from read_one(path)
        except OSError as error:
            raise ParseError(f"{path}: cannot be read: {error.strerror}") from error
    return truncated


def tabulate(names: Sequence[str], table: NDArray[np.float64], where: str) -> pd.DataFrame:
    """Name the columns of a table and make those integers that are.

    Parameters
    ----------
    names : sequence of str
        As many as the table has columns.
    table : ndarray, shape (columns, rows)
        Not copied.
    where : str
        File and place, for the error message.

    Raises
    ------
    ParseError
        If a name occurs twice, or ``id`` or ``type`` is not a whole number.
    """
    if len(set(names)) < len(names):
        raise ParseError(f"{where}: expected columns of different names, found {' '.join(names)}")
    columns = {
        name: _whole(values, name, where) if name in INTEGER_COLUMNS else values
        for name, values in zip(names, table, strict=True)
    }
    return pd.DataFrame(columns, copy=False)


def _whole(values: NDArray[np.float64], name: str, where: str) -> NDArray[np.int64]:
    values = values.copy()  # contiguous, which pays for the copy
    with np.errstate(invalid="ignore"):
        integers = values.astype(np.int64)
    if not np.array_equal(integers, values):
        raise ParseError(f"{where}: expected whole numbers in column {name!r}")
    return integers
