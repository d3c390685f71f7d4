"""Whether a run is whole. The engine's return code alone proves nothing.

SIGTERM ends it with 0 and a normal-looking last line; a run that lost every grain ends with 0.
So five things must hold together: the return code, the sentinel printed last, the last step, the
number of spheres in every row, and the last frame on disk.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from liggghts_driver.case import Case
    from liggghts_driver.results.thermo import Thermo
    from liggghts_driver.rundir import RunDirectory


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
    checks = (
        _returncode(returncode),
        _sentinel(run, sentinel),
        _last_step(case, thermo),
        _spheres(case, thermo),
        _last_frame(case, run),
    )
    return [fault for fault in checks if fault]


def _returncode(returncode: int) -> str | None:
    return None if returncode == 0 else f"the engine ended with return code {returncode}"


def _sentinel(run: RunDirectory, sentinel: str) -> str | None:
    # The whole line: the echoed print command holds the same words.
    lines = run.stdout.read_text(encoding="utf-8", errors="replace").splitlines()
    if sentinel in (line.strip() for line in lines):
        return None
    return "the engine did not reach the end of the deck"


def _last_step(case: Case, thermo: Thermo) -> str | None:
    if thermo.rows.empty:
        return "the engine printed no row of the series"
    last = int(thermo.rows["Step"].iloc[-1])
    return None if last == case.time.steps else f"stopped at step {last} of {case.time.steps}"


def _spheres(case: Case, thermo: Thermo) -> str | None:
    if thermo.rows.empty:
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


def _last_frame(case: Case, run: RunDirectory) -> str | None:
    wanted = case.time.steps // case.time.frame_every * case.time.frame_every
    files = run.frame_files()
    found = int(re.sub(r"\D", "", files[-1].name)) if files else None
    return None if found == wanted else f"the frame of step {wanted} is not there"
