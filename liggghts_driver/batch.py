"""Slurm's commands: how they are called, and what squeue says of one job."""

from __future__ import annotations

import os
import shutil
import subprocess
from typing import TYPE_CHECKING

from liggghts_driver.errors import DriverError

if TYPE_CHECKING:
    from pathlib import Path

#: A busy controller answers late; one that does not answer is given up by the commands themselves.
_TIMEOUT_S = 120.0
#: Of a single job that has ended; of several, those are passed over in silence.
UNKNOWN_JOB = "Invalid job id specified"
#: What stays of the variables that steer Slurm's commands: where the cluster is.
_KEPT = frozenset({"SLURM_CONF", "SLURM_CLUSTERS"})


class SlurmError(DriverError):
    """A command of Slurm is missing, was refused, or found nobody to talk to."""


def slurm(*argv: str, folder: Path | None = None, timeout_s: float = _TIMEOUT_S) -> str:
    """Run a command of Slurm; what it printed.

    Raises
    ------
    SlurmError
        If it is missing, fails, or does not end in time; with its own words.
    """
    if shutil.which(argv[0]) is None:
        raise SlurmError(
            f"{argv[0]}: not found on the PATH; jobs are handled on a machine of the cluster that "
            "has Slurm's commands; on Debian install them with: apt-get install slurm-client"
        )
    try:
        done = subprocess.run(
            argv,
            cwd=folder,
            env=_environment(),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=timeout_s,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise SlurmError(f"{argv[0]}: no answer within {timeout_s:g} s; try again") from None
    if done.returncode:
        words = done.stderr.strip() or done.stdout.strip() or f"return code {done.returncode}"
        hint = "\n  is this a machine of the cluster? Without one: --executor local"
        lost = "Unable to contact" in words or "resolve" in words
        raise SlurmError(f"{argv[0]}: {words}{hint if lost else ''}")
    return done.stdout


def job_states(job: str, timeout_s: float = _TIMEOUT_S) -> list[str]:
    """States of a job, or of a task of an array, as squeue calls them; none when it has ended.

    Raises
    ------
    SlurmError
        If squeue cannot tell.
    """
    try:
        text = slurm("squeue", "--noheader", "--jobs", job, "--format", "%T", timeout_s=timeout_s)
    except SlurmError as error:
        if UNKNOWN_JOB in str(error):
            return []
        raise
    return text.split()


def _environment() -> dict[str, str]:
    """The environment without what would change a command's meaning.

    That is a user's own ``SQUEUE_FORMAT``, and what a surrounding job says of itself: a job that
    is submitted from it would take, for instance, its count of restarts for its own.
    """
    return {
        name: value
        for name, value in os.environ.items()
        if name in _KEPT or not name.startswith(("SQUEUE_", "SLURM_"))
    }
