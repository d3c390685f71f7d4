"""A run that goes on from checkpoints in contacts, beside the same run as a whole."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.contacts import contacts_at, largest_over_radius
from liggghts_driver.engine.stop import Stop
from liggghts_driver.errors import DriverError
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.solve import solve
from liggghts_driver.studies.energy import read_ran
from liggghts_driver.studies.invariants import Invariant
from liggghts_driver.studies.tasks import first_fault, run_folder
from liggghts_driver.sweeps.work import is_done

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from liggghts_driver.scene.model import Scene
    from liggghts_driver.studies.energy import Ran

#: Between a run and the same in parts: rounding, multiplied by some collisions.
_MOST_BY_A_RESTART = 1e-6
#: Checkpoints of a run in parts, each after one piece of it.
_CHECKPOINTS = 3


def restarted(scene: Scene, whole: Ran, runs: Path) -> list[Invariant]:
    """How much a run that goes on from checkpoints in contacts differs from the whole one."""
    name, limit = "change by a restart", _MOST_BY_A_RESTART
    whole_folder = run_folder(scene, runs)
    folder = whole_folder.with_name(f"{whole_folder.name}-parts")
    try:
        if not is_done(folder):
            solve(scene, folder, stop=_InParts(_CHECKPOINTS), report=False)
    except DriverError as error:
        return [Invariant(f"{name} ({first_fault(error)})", math.nan, limit)]
    parts = read_ran(folder)
    apart = float(np.abs(parts.positions_m - whole.positions_m).max())
    share = apart / float(whole.case.population.particle_radii_m.min())
    steps = [checkpoint["step"] for checkpoint in RunDirectory(folder).checkpoints()]
    outside = _CHECKPOINTS - sum(overlap > 0.0 for overlap in overlaps_at(parts, steps))
    return [
        Invariant(name, share, limit),
        Invariant("checkpoints outside a contact", float(outside), 0.0),
    ]


def overlaps_at(ran: Ran, steps: Sequence[int]) -> list[float]:
    """The largest overlap over radius in the frames of some steps; nan where there is no frame."""
    frames = {round(time_s / ran.case.time.step_s): n for n, time_s in enumerate(ran.times_s)}
    return [
        largest_over_radius(contacts_at(ran.positions_m[frames[step]], ran.case))
        if step in frames
        else math.nan
        for step in steps
    ]


class _InParts(Stop):
    """Asks for a checkpoint at the end of the first piece of each of the first launches."""

    def __init__(self, checkpoints: int) -> None:
        super().__init__()
        self._left = checkpoints

    def watch(self, ask: Callable[[], None]) -> Callable[[], None]:
        """As of any wish, but that it asks at once."""
        if self._left > 0:
            self._left -= 1
            ask()
        return super().watch(ask)
