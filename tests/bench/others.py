"""The same spheres in other codes, where Debian's packages of them are installed."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

from tests.bench.timing import wall_seconds

if TYPE_CHECKING:
    from collections.abc import Callable

_HERE = Path(__file__).parent


def yade_task(data: Path, steps: int, step_s: float, *, drag: bool) -> Callable[[], float] | None:
    """Seconds that Yade takes for some steps, by its own clock; None where it is not installed."""
    if shutil.which("yade") is None:
        return None
    mode = "drag" if drag else "contacts"
    script = str(_HERE / "yade_case.py")
    command = ["yade", "-n", "-x", script, str(data), str(steps), repr(step_s), mode]

    def measure() -> float:
        done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=data.parent)
        line = next(line for line in done.stdout.splitlines() if line.startswith("seconds"))
        return float(line.split()[1])

    return measure


def lammps_task(
    data: Path, steps: int, step_s: float, low_m: float, *, drag: bool
) -> Callable[[], float] | None:
    """Seconds that LAMMPS takes for some steps, its start subtracted; None where not installed."""
    if shutil.which("lmp") is None:
        return None
    deck = str(_HERE / "lammps_case.in")

    def command(count: int) -> list[str]:
        values = {
            "data": data.name,  # LAMMPS splits a path at its blanks
            "step": repr(step_s),
            "steps": str(count),
            "low": repr(low_m),
            "drag": str(int(drag)),
        }
        variables = [word for name, value in values.items() for word in ("-var", name, value)]
        return ["lmp", "-in", deck, "-log", "none", "-screen", "none", *variables]

    return lambda: wall_seconds(command(steps), data.parent) - wall_seconds(command(0), data.parent)
