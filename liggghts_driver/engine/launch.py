"""Launch the engine, follow what it prints, and end it with everything it started."""

from __future__ import annotations

import contextlib
import os
import re
import select
import signal
import subprocess
import time
from contextlib import nullcontext
from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver.engine.find import launch_environment, lone_environment
from liggghts_driver.engine.stop import Stop, signals_as_wishes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

#: A row of the log is step, spheres, seconds; nothing else the engine prints has this shape.
_ROW = re.compile(rb"^[ \t]*(\d+)[ \t]+\d+[ \t]+\d[-+0-9.e]*[ \t]*$", re.MULTILINE)
_GRACE_S = 5.0
#: How often it is looked whether the run is wanted no longer.
_LOOK_EVERY_S = 0.1
_CHUNK_BYTES = 65536
#: No row is longer; what is left of a chunk is looked at again with the next one.
_LONGEST_ROW_BYTES = 256


@dataclass(frozen=True)
class Launch:
    """How a launch ended.

    ``cpu_s`` is the processor time of the command and of all that it started, which says what a
    run costs also on a machine that does other things at the same time.
    """

    command: tuple[str, ...]
    returncode: int
    wall_s: float
    cpu_s: float


def launch(
    command: Sequence[str],
    folder: Path,
    stdout: Path,
    on_step: Callable[[int], None] = lambda _step: None,
    stop: Stop | None = None,
    ask: Callable[[], None] = lambda: None,
    look: Callable[[], None] = lambda: None,
    *,
    alone: bool = True,
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
    stop
        The wish to end, which Ctrl-C and the signals of a batch system express too.
    ask
        Asks the command to end by itself, once, when that is wished for.
    look
        Called now and then while the command runs. What it raises ends the command at once.
    alone
        Whether it is one process: its launcher keeps several apart, on all their nodes.

    Raises
    ------
    KeyboardInterrupt
        If it did not end by itself in time: after the whole process group has been ended.
    """
    start = time.perf_counter()
    wish = stop or Stop()
    watch = wish.watch(ask)

    def look_around() -> None:
        watch()
        look()

    with lone_environment() if alone else nullcontext(launch_environment()) as environment:
        process = subprocess.Popen(
            command,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env=environment,
            start_new_session=True,
        )
        try:
            with signals_as_wishes(wish):
                _copy(process, stdout, on_step, look_around)
                cpu_s = _wait(process)
        except BaseException:
            end_group(process)
            raise
    return Launch(tuple(command), process.returncode, time.perf_counter() - start, cpu_s)


def _wait(process: subprocess.Popen[bytes]) -> float:
    """Wait for the end as ``Popen.wait`` does, and return the processor time that it took."""
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return usage.ru_utime + usage.ru_stime


def _copy(
    process: subprocess.Popen[bytes],
    stdout: Path,
    on_step: Callable[[int], None],
    look: Callable[[], None],
) -> None:
    """Copy in chunks of bounded size: a program gone wild may print a line without an end."""
    assert process.stdout is not None
    rest = b""
    with stdout.open("wb", buffering=0) as file, process.stdout:
        for chunk in _chunks(process.stdout.fileno(), look):
            file.write(chunk)
            complete, newline, rest = (rest + chunk).rpartition(b"\n")
            rest = rest[-_LONGEST_ROW_BYTES:]
            for row in _ROW.finditer(complete + newline):
                on_step(int(row.group(1)))


def _chunks(descriptor: int, look: Callable[[], None]) -> Iterator[bytes]:
    """What comes out of a pipe, looking around now and then."""
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    while True:
        ready = poll.poll(1000.0 * _LOOK_EVERY_S)
        look()
        if not ready:
            continue
        chunk = os.read(descriptor, _CHUNK_BYTES)
        if not chunk:
            return
        yield chunk


def end_group(process: subprocess.Popen[bytes]) -> None:
    """End a process and all that it started: first politely, then for good."""
    for number in (signal.SIGINT, signal.SIGKILL):  # the engine is deaf to SIGTERM
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, number)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(_GRACE_S)
            break
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)  # whatever outlived its leader
