"""Reader of the engine's log: the series of thermo rows and what stands between them.

Each ``run`` prints a header and rows under it, until a line "Loop time of ...". Warnings, echoed
commands and texts from ``print`` and ``fix print`` may come in between; they are told from headers
and rows by the layout of these: names right-aligned in 8 or 14 characters, and a space after the
last word of the line, with which also a line that was cut cannot pass for a whole one.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import pandas as pd

from liggghts_driver.errors import ParseError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from liggghts_driver.rundir import RunDirectory

STEP = "Step"

_WIDTHS = (8, 14)
_NUMBER = r"(-?\d+(?:\.\d+)?(?:e[-+]\d+)?)"
_LOOP = re.compile(rf"Loop time of {_NUMBER} on (\d+) procs for (\d+) steps with (\d+) atoms")
_TIMING = re.compile(rf"(\w+) +time \(%\) = {_NUMBER} \(")

Row = dict[str, float]


@dataclass(frozen=True)
class Loop:
    """One "Loop time" line, printed at the end of each run.

    Attributes
    ----------
    seconds : float
        Wall time of the run's steps, in s.
    ranks : int
        MPI processes.
    steps, atoms : int
        Steps of this run, and particles at its end.
    """

    seconds: float
    ranks: int
    steps: int
    atoms: int


@dataclass(frozen=True)
class Thermo:
    """What a log tells.

    Attributes
    ----------
    rows : DataFrame
        All thermo rows in the order of the log. ``Step`` is int64, all other columns are float64,
        NaN where a run did not print them. The engine names a column ``v_name``, ``c_name`` or
        ``f_name`` by the first eight characters of the name alone; where two names thus become
        one, the second is called ``name#2`` and so on. A run prints the last step of the one before
        again: that row is kept once, as first printed, with the columns that only the later run
        has. (After ``reset_timestep`` steps go back: such rows are all kept.)
    loops : tuple of Loop
        Every "Loop time" line.
    timing_s : mapping of str to float
        The engine's own split of the wall time (``Pair``, ``Neigh``, ``Comm``, ``Outpt``,
        ``Other``; ``Modfy`` with ``modify_timing on``) in s, summed over the runs that print it
        (those without ``post no``).
    warnings, errors : tuple of str
        Every line that starts with "WARNING" or "ERROR". Some are on the standard output only,
        among them that of lost particles and the errors of a single process.
    truncated : str or None
        The incomplete last line, if the log does not end in a newline; nothing in it is used.
    """

    rows: pd.DataFrame
    loops: tuple[Loop, ...]
    timing_s: Mapping[str, float]
    warnings: tuple[str, ...]
    errors: tuple[str, ...]
    truncated: str | None


def read_thermo(path: str | Path) -> Thermo:
    """Read ``log.liggghts``, or what the engine wrote to its standard output.

    Only one-line thermo styles (``one``, ``custom``) with a column ``step`` are understood. A log
    without any row, even an empty one, gives an empty table.

    Raises
    ------
    ParseError
        If the file cannot be read.
    """
    try:
        text = Path(path).read_bytes().decode(errors="replace")
    except OSError as error:
        raise ParseError(f"{path}: cannot be read: {error.strerror}") from error
    *lines, rest = text.split("\n")
    log = _Log()
    for line in lines:
        log.take(line)
    return Thermo(
        rows=_frame(log.rows),
        loops=tuple(log.loops),
        timing_s=MappingProxyType(log.timing_s),
        warnings=tuple(line for line in lines if line.startswith("WARNING")),
        errors=tuple(line for line in lines if line.startswith("ERROR")),
        truncated=rest or None,
    )


def read_logs(run: RunDirectory) -> Thermo:
    """The logs of all parts of a run as one.

    Raises
    ------
    ParseError
        If one cannot be read.
    """
    parts = [read_thermo(part.log) for part in run.parts()]
    timing: Counter[str] = Counter()
    for part in parts:
        timing.update(part.timing_s)
    rows = pd.concat([part.rows for part in parts]) if len(parts) > 1 else parts[0].rows
    if len(parts) > 1 and STEP in rows:
        # A part begins with the instant at which the one before it ended.
        rows = rows.drop_duplicates(STEP, ignore_index=True)
    return Thermo(
        rows=rows,
        loops=tuple(loop for part in parts for loop in part.loops),
        timing_s=MappingProxyType(dict(timing)),
        warnings=tuple(line for part in parts for line in part.warnings),
        errors=tuple(line for part in parts for line in part.errors),
        truncated=parts[-1].truncated,
    )


class _Log:
    """What has been read of a log so far."""

    def __init__(self) -> None:
        self.rows: list[Row] = []
        self.loops: list[Loop] = []
        self.timing_s: dict[str, float] = {}
        self._columns: list[str] = []  # of the run at hand; empty between runs
        self._first = False  # whether the next row is the first of its run

    def take(self, line: str) -> None:
        """Read one whole line."""
        if row := _row(line, self._columns):
            self._add(row)
        elif columns := _header(line):
            self._columns = columns
            self._first = True
        elif loop := _LOOP.match(line):
            seconds, *counts = loop.groups()
            self.loops.append(Loop(float(seconds), *map(int, counts)))
            self._columns = []
        elif timing := _TIMING.match(line):
            part, seconds = timing.groups()
            self.timing_s[part] = self.timing_s.get(part, 0.0) + float(seconds)

    def _add(self, row: Row) -> None:
        if self._first and self.rows and self.rows[-1][STEP] == row[STEP]:
            self.rows[-1] = row | self.rows[-1]
        else:
            self.rows.append(row)
        self._first = False


def _header(line: str) -> list[str]:
    """Column names of a header line; nothing if it is another line."""
    words = line.split()
    if STEP not in words:
        return []
    rest = line
    for word in words:
        narrow, wide = (f"{word:>{width}} " for width in _WIDTHS)
        rest = rest.removeprefix(wide if rest.startswith(wide) else narrow)
    return [] if rest else _distinct(words)


def _distinct(words: list[str]) -> list[str]:
    seen: Counter[str] = Counter()
    names = []
    for word in words:
        seen[word] += 1
        names.append(word if seen[word] == 1 else f"{word}#{seen[word]}")
    return names


def _row(line: str, columns: list[str]) -> Row | None:
    """Values of a row; None if it is another line."""
    words = line.split()
    if not columns or len(words) != len(columns) or not line.endswith(" "):
        return None
    try:
        row = dict(zip(columns, map(float, words), strict=True))
        row[STEP] = int(words[columns.index(STEP)])
    except ValueError:
        return None
    return row


def _frame(rows: list[Row]) -> pd.DataFrame:
    frame = pd.DataFrame(rows) if rows else pd.DataFrame(columns=[STEP], dtype="int64")
    return frame.astype({name: "float64" for name in frame if name != STEP})
