"""Reader of the engine's text dumps, ``dump ID group custom N file column ...``.

A frame is nine lines of header and one line per particle::

    ITEM: TIMESTEP
    100
    ITEM: NUMBER OF ATOMS
    21700
    ITEM: BOX BOUNDS ff ff ff
    0 0.1
    0 0.1
    0 0.1
    ITEM: ATOMS id type x y z
    1 1 0.0256803 0.0017038 0.00174213

The file is read in pieces of fixed size and never held as a whole.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from liggghts_driver.errors import ParseError
from liggghts_driver.results.decimals import RowError, parse_rows
from liggghts_driver.results.frames import (
    EndOfFileError,
    Frame,
    FrameGenerator,
    FrameReader,
    Paths,
    Truncation,
    read_files,
    tabulate,
)

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

# Small enough for the numbers of one piece to stay in the processor's cache while they are parsed.
_PIECE = 3 << 16
_DIGITS = 19  # of the largest number that the engine counts to


def iter_text_frames(path_or_paths: Paths) -> FrameReader:
    """Read text dumps frame by frame.

    Parameters
    ----------
    path_or_paths : path or iterable of paths
        One file with any number of frames, or several in the order of their steps.

    Returns
    -------
    FrameReader
        Iterator over the complete frames. Its ``truncated`` names the incomplete frame, if any, at
        the end of the last file; an empty file counts as one.

    Raises
    ------
    ParseError
        While iterating: if a file cannot be read, or anything but its end is not as the engine
        writes it. Boxes that are not orthogonal and columns that are not numbers are refused.
    """
    return read_files(path_or_paths, _read_file)


class _Source:
    """A file as a sequence of lines and of blocks of lines, which knows its line number.

    Only what the file held when it was opened is read, so that it may still be growing.
    """

    def __init__(self, path: Path, stream: BinaryIO) -> None:
        self.path = path
        self.lines = 0
        self.unread = os.fstat(stream.fileno()).st_size
        self._stream = stream
        self._piece = b""
        self._position = 0

    def at_end(self) -> bool:
        return self._position == len(self._piece) and not self._read_on()

    def bytes_left(self) -> int:
        return len(self._piece) - self._position + self.unread

    def fault(self, message: str, line: int) -> ParseError:
        return ParseError(f"{self.path}:{line}: {message}")

    def line(self, expected: str) -> str:
        """Return the next line without its newline."""
        while (stop := self._piece.find(b"\n", self._position)) < 0:
            if not self._read_on():
                raise EndOfFileError(expected)
        line = self._piece[self._position : stop]
        self._position = stop + 1
        self.lines += 1
        return line.decode(errors="replace")

    def rows(self, expected: str) -> bytes:
        """Return some of the lines before the next "ITEM", nothing if that comes next.

        No number that the engine writes has a capital I.
        """
        while (stop := self._piece.find(b"I", self._position)) != self._position:
            if stop < 0:
                stop = self._piece.rfind(b"\n", self._position) + 1
            if stop > self._position:
                rows = self._piece[self._position : stop]
                self._position = stop
                return rows
            if not self._read_on():
                raise EndOfFileError(expected)
        return b""

    def _read_on(self) -> bool:
        if len(self._piece) - self._position > _PIECE:
            raise self.fault(f"expected a line to end within {_PIECE} bytes", self.lines + 1)
        more = self._stream.read(min(_PIECE, self.unread))
        self.unread -= len(more)
        self._piece = self._piece[self._position :] + more
        self._position = 0
        return bool(more)


def _read_file(path: Path) -> FrameGenerator:
    with path.open("rb", buffering=0) as stream:
        source = _Source(path, stream)
        if source.at_end():
            return Truncation(path, "line 1", "'ITEM: TIMESTEP'")
        while not source.at_end():
            first_line = source.lines + 1
            try:
                frame = _read_frame(source)
            except EndOfFileError as end:
                return Truncation(path, f"line {first_line}", str(end))
            yield frame
    return None


def _read_frame(source: _Source) -> Frame:
    _item(source, "ITEM: TIMESTEP")
    step = _whole_number(source)
    _item(source, "ITEM: NUMBER OF ATOMS")
    count = _whole_number(source)
    if tilts := {"xy", "xz", "yz"} & set(_item(source, "ITEM: BOX BOUNDS")):
        raise source.fault(f"expected an orthogonal box, found tilts {tilts}", source.lines)
    box = np.array([_bounds(source) for _ in range(3)])
    names = _item(source, "ITEM: ATOMS")
    if not names:
        raise source.fault("expected the names of the columns", source.lines)
    where = f"{source.path}:{source.lines}"
    return Frame(step, box, tabulate(names, _read_table(source, count, len(names)), where))


def _item(source: _Source, title: str) -> list[str]:
    """Read a line that starts with `title` and return the words after it."""
    line = source.line(repr(title))
    if not f"{line} ".startswith(f"{title} "):
        raise source.fault(f"expected {title!r}, found {line!r}", source.lines)
    return line.removeprefix(title).split()


def _whole_number(source: _Source) -> int:
    line = source.line("a whole number")
    if not line.isdecimal() or len(line) > _DIGITS:
        raise source.fault(f"expected a whole number, found {line[:60]!r}", source.lines)
    return int(line)


def _bounds(source: _Source) -> list[float]:
    line = source.line("the bounds of the box")
    try:
        lower, upper = map(float, line.split())
    except ValueError:
        raise source.fault(
            f"expected a lower and an upper bound, found {line!r}", source.lines
        ) from None
    return [lower, upper]


def _read_table(source: _Source, count: int, columns: int) -> NDArray[np.float64]:
    # A number takes at least two bytes: a wrong count must not ask for more memory than there is.
    room = min(count, source.bytes_left() // (2 * columns))
    table = np.empty((columns, room))
    filled = 0
    while filled < count:
        missing = f"{count - filled} of {count} lines of numbers"
        if not (text := source.rows(missing)):
            raise source.fault(f"expected another {missing}", source.lines + 1)
        part = _parse(source, text, columns)
        rows = len(part)
        if filled + rows > count:
            raise source.fault(
                f"expected the frame to end after {count} lines of numbers",
                source.lines + count - filled + 1,
            )
        table[:, filled : filled + rows] = part.T
        filled += rows
        source.lines += rows
    return table


def _parse(source: _Source, text: bytes, columns: int) -> NDArray[np.float64]:
    try:
        return parse_rows(text, columns)
    except RowError as error:
        raise source.fault(str(error), source.lines + error.row + 1) from None
