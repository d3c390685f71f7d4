"""Find the engine and the programs that launch it."""

from __future__ import annotations

import functools
import os
import re
import shlex
import shutil
import subprocess
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from liggghts_driver.errors import EngineNotFoundError

if TYPE_CHECKING:
    from collections.abc import Iterator

_YIELD_VARIABLE = "OMPI_MCA_mpi_yield_when_idle"
#: How to get each program on Debian.
INSTALL = {
    "liggghts": "apt-get install --no-install-recommends liggghts",
    "mpirun": "apt-get install --no-install-recommends openmpi-bin",
    "stdbuf": "apt-get install coreutils",
    "env": "apt-get install coreutils",
    "setpriv": "apt-get install util-linux",
}
#: Set this to use another binary than the `liggghts` of the PATH.
BINARY_VARIABLE = "LIGGGHTS_DRIVER_BINARY"
#: Set this where another program than Open MPI's starts ranks, e.g. "srun --mpi=pmi2 -n {ranks}".
LAUNCHER_VARIABLE = "LIGGGHTS_DRIVER_LAUNCHER"


#: Signals that a batch system sends to every process of a job. They are for the driver, which then
#: asks the engine for a checkpoint; the engine itself would stop at once and lose it.
_FOR_THE_DRIVER = "TERM,HUP,USR1"
#: How the engine is told to read the deck, where to log, and to echo every command.
BATCH_ARGUMENTS = ("-in", "deck.in", "-log", "log.liggghts", "-echo", "both")


@dataclass(frozen=True)
class Engine:
    """The engine's binary and its version."""

    binary: str
    version: str

    def command(self, ranks: int = 1) -> list[str]:
        """The command that runs ``deck.in`` of the working folder.

        ``stdbuf -oL``: without line buffering the engine's last words are lost in a pipe.
        ``setpriv --pdeathsig``: a driver that is killed takes the engine with it.

        Raises
        ------
        EngineNotFoundError
            If a launcher is missing.
        """
        deaf = [require("env"), f"--block-signal={_FOR_THE_DRIVER}"]
        engine = [*deaf, require("stdbuf"), "-oL", self.binary, *BATCH_ARGUMENTS]
        bound = [require("setpriv"), "--pdeathsig", "KILL"]
        if ranks == 1:
            return [*bound, *engine]
        launcher = _launcher(ranks)
        return [*bound, *deaf, *launcher, *engine]


def _launcher(ranks: int) -> list[str]:
    """The words that start something on so many ranks.

    By itself Open MPI binds every job to the first cores; runs side by side would share them.

    Raises
    ------
    EngineNotFoundError
        If the launcher is missing.
    """
    text = os.environ.get(LAUNCHER_VARIABLE, "mpirun --bind-to none -np {ranks}")
    try:
        words = shlex.split(text)
    except ValueError as error:
        raise EngineNotFoundError(f"{LAUNCHER_VARIABLE} = {text!r}: {error}") from None
    program, *arguments = words or ["mpirun"]
    return [require(program), *(word.replace("{ranks}", str(ranks)) for word in arguments)]


def launch_environment() -> dict[str, str]:
    """The environment of a launch: one thread per rank; Open MPI takes root only if told twice.

    A single process without ``isolated`` starts a helper of Open MPI, which costs a tenth of a
    second, and whose end by a batch system's SIGTERM ends the engine too. Ranks that wait for each
    other ``yield`` their core: where others want it, waiting by turning in circles takes many times
    as long.
    """
    extra = {
        "OMP_NUM_THREADS": "1",
        "OMPI_MCA_ess_singleton_isolated": "1",
        _YIELD_VARIABLE: os.environ.get(_YIELD_VARIABLE, "1"),
    }
    if os.geteuid() == 0:
        extra |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    return {**os.environ, **extra}


@contextmanager
def lone_environment() -> Iterator[dict[str, str]]:
    """The environment of a launch of one process, with a folder of Open MPI's own for it alone.

    Isolated processes would all have the same one, and each removes it when it ends: also under
    another that is about to start.
    """
    with TemporaryDirectory(prefix="liggghts-driver-", ignore_cleanup_errors=True) as folder:
        yield {**launch_environment(), "OMPI_MCA_orte_tmpdir_base": folder}


def require(program: str) -> str:
    """Path of a program.

    Raises
    ------
    EngineNotFoundError
        With the command that installs it.
    """
    found = shutil.which(program)
    if found is None:
        raise EngineNotFoundError(
            f"{program}: not found on the PATH; install it"
            + (f" with: {INSTALL[program]}" if program in INSTALL else "")
        )
    return found


def find_engine() -> Engine:
    """The engine on this machine.

    Raises
    ------
    EngineNotFoundError
        If it is missing, does not start or is another program; with the way out.
    """
    chosen = os.environ.get(BINARY_VARIABLE)
    if chosen is None:
        binary = require("liggghts")
    else:
        found = shutil.which(chosen)
        if found is None:
            raise EngineNotFoundError(
                f"{BINARY_VARIABLE} = {chosen!r}: no such program; unset it or correct it"
            )
        binary = found
    # Runs have folders of their own, in which a relative path would mean nothing.
    binary = str(Path(binary).absolute())
    return Engine(binary, _version(binary))


@functools.lru_cache
def _version(binary: str) -> str:
    """What the engine calls itself when it is given nothing to do."""
    try:
        with lone_environment() as environment:
            done = subprocess.run(
                [binary, "-log", "none", "-in", os.devnull],
                capture_output=True,
                timeout=30,
                check=False,
                env=environment,
            )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise EngineNotFoundError(f"{binary}: does not start ({error})") from error
    match = re.search(r"LIGGGHTS \(Version ([^,)]+)", done.stdout.decode(errors="replace"))
    if match is None:
        raise EngineNotFoundError(
            f"{binary}: is not LIGGGHTS; correct {BINARY_VARIABLE}, or install the engine with: "
            f"{INSTALL['liggghts']}"
        )
    return match.group(1).strip()
