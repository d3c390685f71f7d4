"""The study of the paper: its example run in all its readings, and the page that judges it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from liggghts_driver.cli.options import CHECKPOINT_EVERY_S, INTERRUPTED, RUNS, Json

Runs = Annotated[Path, typer.Option("--runs", help="Folder of all runs, shared with sweeps.")]
DOCS = Path("docs")
#: How often a run that failed is tried again.
_RETRIES = 1


def paper(
    runs: Runs = RUNS,
    docs: Annotated[
        Path, typer.Option("--docs", help="Where paper.md, its figures and stored results go.")
    ] = DOCS,
    only: Annotated[
        Optional[list[str]],  # noqa: UP045 - typer reads this form on every Python
        typer.Option(
            "--only",
            metavar="SWEEP",
            help="Run this sweep of cases/paper alone; may be given several times.",
            show_default=False,
        ),
    ] = None,
    collect_only: Annotated[
        bool, typer.Option("--collect-only", help="Run nothing; write the page from what has run.")
    ] = False,
    cores: Annotated[
        Optional[int],  # noqa: UP045
        typer.Option("--cores", min=1, help="Cores to use; default: all.", show_default=False),
    ] = None,
    as_json: Json = False,
) -> None:
    """The paper's example in all its readings, held against what it prints: hours, resumable.

    Exit code 0 only if every point has been run.
    """
    from liggghts_driver.cli import show_paper
    from liggghts_driver.paper.catalogue import SWEEPS
    from liggghts_driver.paper.write import write_all

    unknown = [name for name in only or () if name not in SWEEPS]
    if unknown:
        names = ", ".join(map(repr, unknown))
        raise typer.BadParameter(f"--only {names}: no sweep; valid: {', '.join(SWEEPS)}")
    stopped = not collect_only and _run([n for n in SWEEPS if not only or n in only], runs, cores)
    written = write_all(runs, docs)
    show_paper.paper(written, as_json=as_json)
    if stopped:
        typer.echo("interrupted; the same command goes on from there", err=True)
        raise typer.Exit(INTERRUPTED)
    if any(point.answer is None for point in written.stored.points(*(only or ()))):
        raise typer.Exit(1)


def _run(names: list[str], runs: Path, cores: int | None) -> bool:
    """Run what is still to be done; whether it was asked to stop."""
    from liggghts_driver.cli import show_sweep
    from liggghts_driver.engine.find import find_engine
    from liggghts_driver.engine.stop import Stop
    from liggghts_driver.paper.tasks import tasks_to_do
    from liggghts_driver.sweeps.local import cores_here, run_local

    tasks = tasks_to_do(names, runs)
    if not tasks:
        return False
    find_engine()  # one message instead of as many failures as there are runs
    stop = Stop(checkpoint_every_s=CHECKPOINT_EVERY_S)
    used = cores_here()[:cores]
    with show_sweep.following(tasks, len(used), quiet=False) as listener:
        outcomes = run_local(tasks, stop, _RETRIES, used, listener)
    for name, outcome in outcomes.items():
        if outcome.ending in ("failed", "busy"):
            typer.echo(f"{outcome.ending}: {name}: {outcome.reason}", err=True)
    return stop.asked
