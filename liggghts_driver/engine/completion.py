"""Whether a run is whole. The engine's return code alone proves nothing.

SIGTERM ends it with 0 and a normal-looking last line; a run that lost every grain ends with 0.
So six things must hold together: the return code, the sentinel printed last, the last step, the
number of spheres in every row, the series to its end, and every frame whole on disk.
"""

from __future__ import annotations

import re
import signal
from typing import TYPE_CHECKING

from liggghts_driver.deck.build import FRAME_COLUMNS
from liggghts_driver.errors import ParseError
from liggghts_driver.results.binarydump import iter_binary_frames
from liggghts_driver.results.series import read_parts
from liggghts_driver.timestep import frame_steps

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from liggghts_driver.case import Case
    from liggghts_driver.results.thermo import Thermo
    from liggghts_driver.rundir import RunDirectory

#: The sentinel is the last thing printed; what follows it is a few lines at most.
_END_BYTES = 65536
_SIGNALS = {int(each) for each in signal.Signals}


def missing_proofs(
    case: Case, sentinel: str, run: RunDirectory, thermo: Thermo, returncode: int
) -> list[str]:
    """What keeps a run from being proven complete; nothing when it is.

    Parameters
    ----------
    case
        What was asked for.
    sentinel
        The line that the deck prints last.
    run
        Where the engine wrote.
    thermo
        The series as read from its log.
    returncode
        Of the engine.
    """
    checks = (_returncode(returncode), _sentinel(run, sentinel))
    return [*(fault for fault in checks if fault), *missing_data(case, run, thermo)]


def missing_data(case: Case, run: RunDirectory, thermo: Thermo) -> list[str]:
    """What of a run's data is not there, or not whole; nothing when all is.

    Parameters
    ----------
    case, run, thermo
        As for `missing_proofs`.
    """
    checks = (
        _last_step(case, thermo),
        _spheres(case, thermo),
        _series(case, run.parts(), case.time.steps),
        _frames(case, run.frame_files(), case.time.steps),
    )
    return [fault for fault in checks if fault]


def missing_so_far(case: Case, run: RunDirectory, step: int) -> list[str]:
    """What of an unfinished run's data is not there, or not whole, up to a checkpoint."""
    checks = (_series(case, run.segments(), step), _frames(case, run.kept_frame_files(), step))
    return [fault for fault in checks if fault]


def _returncode(returncode: int) -> str | None:
    if returncode == 0:
        return None
    killed = f" ({signal.Signals(-returncode).name})" if -returncode in _SIGNALS else ""
    return f"the engine ended with return code {returncode}{killed}"


def last_line_with(run: RunDirectory, start: str) -> str | None:
    """The last line that the engine printed with such a start; None if it printed none.

    The echoed print command holds the same words, but does not start with them.
    """
    with run.stdout.open("rb") as file:
        file.seek(max(0, run.stdout.stat().st_size - _END_BYTES))
        lines = file.read().decode("utf-8", errors="replace").splitlines()
    found = [line.strip() for line in lines if line.startswith(start)]
    return found[-1] if found else None


def _sentinel(run: RunDirectory, sentinel: str) -> str | None:
    # The whole line, not one that a crash cut off or lengthened.
    if last_line_with(run, sentinel) == sentinel:
        return None
    return "the engine did not reach the end of the deck"


def _last_step(case: Case, thermo: Thermo) -> str | None:
    if thermo.rows.empty or not {"Step", "Atoms"} <= set(thermo.rows):
        return "the engine's log has no row of the series"
    last = int(thermo.rows["Step"].iloc[-1])
    return None if last == case.time.steps else f"stopped at step {last} of {case.time.steps}"


def _spheres(case: Case, thermo: Thermo) -> str | None:
    if "Atoms" not in thermo.rows:
        return None
    expected = len(case.population.radii_m)
    short = thermo.rows[thermo.rows["Atoms"] != expected]
    if short.empty:
        return None
    first = short.iloc[0]
    return (
        f"{expected - int(first['Atoms'])} of {expected} spheres were lost by step "
        f"{int(first['Step'])}"
    )


def _series(case: Case, parts: Sequence[RunDirectory], end: int) -> str | None:
    """Whether the series has every row up to some step."""
    try:
        steps = read_parts(parts)["step"]
    except ParseError as error:
        return str(error)
    last, every = int(steps.iloc[-1]) if len(steps) else 0, case.time.sample_every
    if steps.tolist() == list(range(every, end + 1, every)):
        return None
    return f"the series ends at step {last} of {end}, or has gaps"


def _frames(case: Case, files: Sequence[Path], end: int) -> str | None:
    """Whether every frame up to some step is there and whole."""
    steps = [step for step in frame_steps(case.time) if step <= end]
    found = [int(re.sub(r"\D", "", path.name)) for path in files]
    if found != steps:
        missing = sorted(set(steps) - set(found))
        return f"the frame of step {missing[0]} is not there" if missing else "frames to spare"
    if not files:
        return None
    # Every frame holds the same spheres, so all are of one size; the last is looked into.
    sizes = {path.stat().st_size for path in files}
    reader = iter_binary_frames(files[-1:], FRAME_COLUMNS)
    try:
        counts = [len(frame.data) for frame in reader]
    except ParseError as error:
        return str(error)
    if len(sizes) == 1 and counts == [case.population.particles]:
        return None
    return "a frame is cut off or does not hold every particle"
