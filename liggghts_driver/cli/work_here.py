"""Running many tasks on this machine, as sweeps and the study of the paper do."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from liggghts_driver.cli.options import CHECKPOINT_EVERY_S
from liggghts_driver.errors import SweepError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from liggghts_driver.sweeps.task import Task


def work_here(tasks: Sequence[Task], tries: int, cores: int | None, *, quiet: bool) -> bool:
    """Do tasks side by side, and name those that failed; whether it was asked to stop.

    Raises
    ------
    EngineNotFoundError
        If there is something to do and no engine.
    SweepError
        If more cores are asked for than there are.
    """
    from liggghts_driver.cli import show_sweep
    from liggghts_driver.engine.find import find_engine
    from liggghts_driver.engine.stop import Stop
    from liggghts_driver.sweeps.local import cores_here, run_local

    stop = Stop(checkpoint_every_s=CHECKPOINT_EVERY_S)
    if tasks:
        find_engine()  # one message instead of as many failures as there are runs
    here = cores_here()
    if cores is not None and cores > len(here):
        raise SweepError(f"--cores {cores}: must be at most {len(here)}, what this machine lends")
    used = here[:cores]
    with show_sweep.following(tasks, len(used), quiet=quiet) as listener:
        outcomes = run_local(tasks, stop, tries, used, listener)
    for name, outcome in outcomes.items():
        if outcome.ending in ("failed", "busy"):
            typer.echo(f"{outcome.ending}: {name}: {outcome.reason}", err=True)
    return stop.asked
