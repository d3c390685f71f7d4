"""Reader of the engine's binary dumps, ``dump ID group custom N file.bin column ...``.

A frame is a header and, for each process of the run, a block of its particles. All numbers are in
the byte order of the machine that ran the engine, taken to be little-endian::

    int64   step, particles
    int32   1 if the box is triclinic
    int32   boundary styles of the six faces
    float64 xlo xhi ylo yhi zlo zhi
    int32   columns, blocks
    then for each block
    int32   n, numbers in the block
    float64 n numbers, particle by particle

The names of the columns are not in the file.
"""

from __future__ import annotations

import os
import struct
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.errors import ParseError
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
    from collections.abc import Sequence
    from io import BufferedReader
    from pathlib import Path

    from numpy.typing import NDArray

_HEADER = struct.Struct("<qqi6i6dii")
_BLOCK_SIZE = struct.Struct("<i")
_NUMBER_BYTES = 8


def iter_binary_frames(path_or_paths: Paths, columns: Sequence[str]) -> FrameReader:
    """Read binary dumps frame by frame.

    Parameters
    ----------
    path_or_paths : path or iterable of paths
        One file with any number of frames (``file.bin``), or several in the order of their steps
        (``file.*.bin`` gives one file per frame).
    columns : sequence of str
        The columns of the dump command.

    Returns
    -------
    FrameReader
        Iterator over the complete frames. Its ``truncated`` names the incomplete frame, if any, at
        the end of the last file; an empty file counts as one.

    Raises
    ------
    ParseError
        While iterating: if a file cannot be read, its frames have another number of columns, or
        anything but its end is not as the engine writes it. Boxes that are not orthogonal are
        refused.
    """
    return read_files(path_or_paths, partial(_read_file, names=tuple(columns)))


def _read_file(path: Path, names: tuple[str, ...]) -> FrameGenerator:
    with path.open("rb") as stream:
        while (start := stream.tell()) == 0 or _bytes_left(stream):
            try:
                frame = _read_frame(stream, names, f"{path}: frame at byte {start}")
            except EndOfFileError as end:
                return Truncation(path, f"byte {start}", str(end))
            yield frame
    return None


def _read_frame(stream: BufferedReader, names: tuple[str, ...], where: str) -> Frame:
    header = _HEADER.unpack(_read(stream, _HEADER.size, "its header"))
    step, count, triclinic = header[:3]
    box = np.array(header[9:15]).reshape(3, 2)
    columns, blocks = header[15:]
    if min(step, count, triclinic, columns - 1, blocks - 1) < 0:
        raise ParseError(f"{where}: expected the header of a frame, found {header}")
    if triclinic:
        raise ParseError(f"{where}: expected an orthogonal box")
    if columns != len(names):
        raise ParseError(
            f"{where}: expected {len(names)} columns ({' '.join(names)}), found {columns}"
        )
    # A wrong count must not ask for more memory than the file could fill.
    room = min(count, _bytes_left(stream) // (_NUMBER_BYTES * columns))
    table = np.empty((room, columns), dtype="<f8")
    _fill(table.ravel(), stream, count * columns, blocks, where)
    return Frame(step, box, tabulate(names, table.T, where))


def _fill(
    table: NDArray[np.float64], stream: BufferedReader, numbers: int, blocks: int, where: str
) -> None:
    filled = 0
    for block in range(blocks):
        missing = f"block {block + 1} of {blocks}"
        (size,) = _BLOCK_SIZE.unpack(_read(stream, _BLOCK_SIZE.size, missing))
        if not 0 <= size <= numbers - filled:
            raise ParseError(
                f"{where}: expected at most {numbers - filled} numbers in {missing}, found {size}"
            )
        piece = table[filled : filled + size]
        if piece.size < size or stream.readinto(piece.data) < piece.nbytes:
            raise EndOfFileError(missing)
        filled += size
    if filled != numbers:
        raise ParseError(f"{where}: expected {numbers} numbers in {blocks} blocks, found {filled}")


def _read(stream: BufferedReader, size: int, missing: str) -> bytes:
    data = stream.read(size)
    if len(data) < size:
        raise EndOfFileError(missing)
    return data


def _bytes_left(stream: BufferedReader) -> int:
    return os.fstat(stream.fileno()).st_size - stream.tell()
