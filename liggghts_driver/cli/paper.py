"""The study of the paper: its example run in all its readings, and the page that judges it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from liggghts_driver.cli.options import GOES_ON, RUNS, Cores, Json, Runs, interrupted
from liggghts_driver.cli.work_here import work_here

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
    again: Annotated[
        bool, typer.Option("--again", help="Run also the points whose answers are stored already.")
    ] = False,
    cores: Cores = None,
    as_json: Json = False,
) -> None:
    """The paper's example in all its readings, held against what it prints: hours, resumable.

    The first packing of every point is run before the others. Exit code 0 only if every point has
    been run.
    """
    from liggghts_driver.cli import show_paper
    from liggghts_driver.paper.catalogue import SWEEPS
    from liggghts_driver.paper.stored import read_stored
    from liggghts_driver.paper.tasks import tasks_to_do
    from liggghts_driver.paper.write import require_own_docs, results_file, write_all

    unknown = [name for name in only or () if name not in SWEEPS]
    if unknown:
        names = ", ".join(map(repr, unknown))
        raise typer.BadParameter(f"--only {names}: no sweep; valid: {', '.join(SWEEPS)}")
    require_own_docs(docs)
    wanted = [name for name in SWEEPS if not only or name in only]
    stored = None if again else read_stored(results_file(docs))
    tasks = [] if collect_only else tasks_to_do(wanted, runs, stored)
    stopped = work_here(tasks, _RETRIES, cores, quiet=False) if tasks else False
    written = write_all(runs, docs)
    show_paper.paper(written, as_json=as_json)
    if stopped:
        interrupted(GOES_ON)
    if any(point.answer is None for point in written.stored.points(*(only or ()))):
        raise typer.Exit(1)
