"""Launch the engine, follow what it prints, and end it with everything it started."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import threading
import time
from dataclasses import dataclass
from signal import SIGHUP, SIGTERM
from typing import TYPE_CHECKING

from liggghts_driver.engine.find import launch_environment

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path
    from types import FrameType

#: A row of the log is step, spheres, seconds; nothing else the engine prints has this shape.
_ROW = re.compile(rb"^[ \t]*(\d+)[ \t]+\d+[ \t]+\d[-+0-9.e]*[ \t]*$", re.MULTILINE)
_GRACE_S = 5.0
_CHUNK_BYTES = 65536
#: No row is longer; what is left of a chunk is looked at again with the next one.
_LONGEST_ROW_BYTES = 256


@dataclass(frozen=True)
class Launch:
    """How a launch ended."""

    command: tuple[str, ...]
    returncode: int
    wall_s: float


def launch(
    command: Sequence[str],
    folder: Path,
    stdout: Path,
    on_step: Callable[[int], None] = lambda _step: None,
) -> Launch:
    """Run a command in a folder until it ends, copying what it prints to a file.

    Parameters
    ----------
    command
        Program and arguments; no shell is involved.
    folder
        Its working folder.
    stdout
        Where its output goes, standard error included.
    on_step
        Called with the step of each row of the series as it appears.

    Raises
    ------
    KeyboardInterrupt
        After the whole process group has been ended.
    """
    start = time.perf_counter()
    process = subprocess.Popen(
        command,
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env=launch_environment(),
        start_new_session=True,
    )
    try:
        with _signals_as_interrupt():
            _copy(process, stdout, on_step)
            returncode = process.wait()
    except BaseException:
        end_group(process)
        raise
    return Launch(tuple(command), returncode, time.perf_counter() - start)


def _copy(process: subprocess.Popen[bytes], stdout: Path, on_step: Callable[[int], None]) -> None:
    """Copy in chunks of bounded size: a program gone wild may print a line without an end."""
    assert process.stdout is not None
    rest = b""
    with stdout.open("wb", buffering=0) as file, process.stdout:
        while chunk := os.read(process.stdout.fileno(), _CHUNK_BYTES):
            file.write(chunk)
            complete, newline, rest = (rest + chunk).rpartition(b"\n")
            rest = rest[-_LONGEST_ROW_BYTES:]
            for row in _ROW.finditer(complete + newline):
                on_step(int(row.group(1)))


@contextlib.contextmanager
def _signals_as_interrupt() -> Iterator[None]:
    """Take the end of a batch job or of a terminal for Ctrl-C, so that the engine ends too."""

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set handlers
        return
    before = {number: signal.signal(number, interrupt) for number in (SIGTERM, SIGHUP)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def end_group(process: subprocess.Popen[bytes]) -> None:
    """End a process and all that it started: first politely, then for good."""
    for number in (signal.SIGTERM, signal.SIGKILL):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, number)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(_GRACE_S)
            break
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)  # whatever outlived its leader
