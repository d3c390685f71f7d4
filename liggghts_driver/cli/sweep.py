"""The commands of parameter sweeps."""

from __future__ import annotations

import json
import math
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, Optional

import typer

from liggghts_driver.cli.options import (
    CHECKPOINT_EVERY_S,
    GOES_ON,
    INTERRUPTED,
    RUNS,
    Cores,
    Json,
    Overrides,
    Runs,
    interrupted,
)
from liggghts_driver.cli.work_here import work_here

if TYPE_CHECKING:
    from collections.abc import Sequence

    from liggghts_driver.sweeps.plan import Plan, Point

_POLL_EVERY_S = 10.0

SweepFile = Annotated[Path, typer.Argument(help="Sweep file (TOML).", show_default=False)]
SweepPlace = Annotated[
    Path, typer.Argument(metavar="SWEEP", help="Sweep file or its folder.", show_default=False)
]
Out = Annotated[
    Optional[Path],  # noqa: UP045 - typer reads this form on every Python
    typer.Option(
        "--out", help="The sweep's folder; default: runs/sweep-<file>.", show_default=False
    ),
]


@dataclass(frozen=True)
class Place:
    """Where a sweep and its runs are, and how it is reported."""

    folder: Path
    runs: Path
    as_json: bool


sweep = typer.Typer(
    help="Run a scene at many points, here or on a cluster.",
    no_args_is_help=True,
    rich_markup_mode=None,
)


@sweep.callback()
def _sweeps() -> None:
    """Run a scene at many points, here or on a cluster."""


@sweep.command()
def run(
    file: SweepFile,
    out: Out = None,
    runs: Runs = RUNS,
    executor: Annotated[
        Literal["local", "slurm"], typer.Option("--executor", help="Where the runs are done.")
    ] = "local",
    cores: Cores = None,
    retries: Annotated[
        Optional[int],  # noqa: UP045
        typer.Option(
            "--retries",
            min=0,
            help="Tries after a failure; default: the file's.",
            show_default=False,
        ),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Show points, cost and disk; run nothing.")
    ] = False,
    wait: Annotated[
        bool, typer.Option("--wait", help="With slurm: stay until the queue is empty.")
    ] = False,
    overrides: Overrides = None,
    as_json: Json = False,
) -> None:
    """Do every point that is not done yet; the same command goes on with an interrupted sweep.

    Exit code 0 if all are done, whatever their verdicts, which are counted; those of `collect` ask
    for valid ones.
    """
    from liggghts_driver.cli import show_sweep
    from liggghts_driver.sweeps.plan import make_plan, write_plan
    from liggghts_driver.sweeps.status import run_states
    from liggghts_driver.sweeps.tasks import to_do

    plan = make_plan(file, overrides or ())
    folder = out or default_folder(file)
    tries = plan.retries if retries is None else retries
    states = run_states({point.run for point in plan.points}, runs, _queued(folder, plan))
    points = to_do(plan, states, tries)
    if not as_json:
        show_sweep.preview(plan, points, folder, _free_bytes(runs))
    if dry_run:
        if as_json:
            show_sweep.preview_document(plan, points, folder)
        return
    write_plan(plan, folder)
    if executor == "slurm":
        _submit(plan, points, Place(folder, runs, as_json), wait=wait)
        return
    _run_here(plan, points, Place(folder, runs, as_json), tries, cores)


def _run_here(
    plan: Plan, points: Sequence[Point], place: Place, tries: int, cores: int | None
) -> None:
    from liggghts_driver.sweeps.tasks import task_of

    tasks = [task_of(plan, point, place.runs) for point in points]
    stopped = work_here(tasks, tries, cores, quiet=place.as_json)
    counted = _report(plan, place)
    if stopped:
        interrupted(GOES_ON)
    if counted["done"] < len(plan.points):
        raise typer.Exit(1)


def _submit(plan: Plan, points: Sequence[Point], place: Place, *, wait: bool) -> None:
    from liggghts_driver.sweeps.slurm import submit

    words = [sys.executable, "-m", "liggghts_driver", "sweep", "work", str(place.folder.absolute())]
    command = [*words, "--runs", str(place.runs.absolute())]
    indices = [point.index for point in points]
    made = submit(plan, indices, place.folder, command) if points else []
    if not place.as_json:
        for each in made:
            typer.echo(f"submitted: job {each.job_id}, {each.tasks} tasks")
    while wait and _queued(place.folder, plan):
        time.sleep(_POLL_EVERY_S)
    counted = _report(plan, place)
    if wait and counted["done"] < len(plan.points):
        raise typer.Exit(1)


@sweep.command()
def status(place: SweepPlace, runs: Runs = RUNS, as_json: Json = False) -> None:
    """How many points are done, running, waiting, failed and why, or lost."""
    folder = folder_of(place)
    _report(_planned(folder), Place(folder, runs, as_json))


@sweep.command()
def collect(place: SweepPlace, runs: Runs = RUNS, as_json: Json = False) -> None:
    """One table of all results, figures, and a page that links every run's report.

    Exit code 0 only if every point has a valid answer.
    """
    from liggghts_driver.cli import show_sweep
    from liggghts_driver.solve import load
    from liggghts_driver.sweeps.collect import collect as collect_results

    folder = folder_of(place)
    collected = collect_results(_planned(folder), folder, runs, sys.argv, write_report_of=load)
    show_sweep.collected(collected, folder, as_json=as_json)
    if collected.verdicts.get("valid", 0) < len(collected.points):
        raise typer.Exit(1)


@sweep.command()
def cancel(place: SweepPlace, as_json: Json = False) -> None:
    """Take the sweep's jobs out of the cluster's queue; runs keep their checkpoints."""
    from liggghts_driver.sweeps.plan import read_plan
    from liggghts_driver.sweeps.slurm import cancel as cancel_jobs

    folder = folder_of(place)
    read_plan(folder)  # a folder that is none shall not look like an empty queue
    gone = cancel_jobs(folder)
    words = f"cancelled: {', '.join(gone) or 'nothing was queued'}"
    typer.echo(json.dumps({"cancelled": gone}) if as_json else words)


@sweep.command(hidden=True)
def work(
    folder: Path,
    list_file: Annotated[Path, typer.Option("--list")],
    task: Annotated[int, typer.Option("--task")],
    runs: Runs = RUNS,
) -> None:
    """Do the points of one task of a job array: what a batch script calls."""
    from liggghts_driver.claim import current_job
    from liggghts_driver.engine.stop import Stop, signals_as_wishes
    from liggghts_driver.sweeps.plan import read_plan
    from liggghts_driver.sweeps.tasks import label, task_of
    from liggghts_driver.sweeps.work import work_on

    plan = read_plan(folder)
    lines = list_file.read_text(encoding="utf-8").splitlines()
    stop = Stop(checkpoint_every_s=CHECKPOINT_EVERY_S)
    endings = []
    with signals_as_wishes(stop):
        for index in map(int, lines[task].split()):
            if stop.asked:
                break
            point = plan.points[index]
            outcome = work_on(task_of(plan, point, runs), plan.retries, stop)
            typer.echo(f"{label(point)}: {outcome.ending} {outcome.reason}".rstrip())
            endings.append(outcome.ending)
    if stop.asked and stop.signal == signal.SIGUSR1:
        # Its time is up; the rest is done when it is its turn again. After SIGTERM the cluster
        # itself puts a preempted job back, and one that was cancelled shall not come back.
        subprocess.run(["scontrol", "requeue", str(current_job())], check=False)
    if stop.asked:
        raise typer.Exit(INTERRUPTED)
    if "failed" in endings:
        raise typer.Exit(1)


def default_folder(file: Path) -> Path:
    """``runs/sweep-<name of the file>``."""
    return Path("runs") / f"sweep-{file.stem}"


def folder_of(place: Path) -> Path:
    """The folder of a sweep, given itself or by the sweep's file."""
    return default_folder(place) if place.is_file() or place.suffix == ".toml" else place


def _planned(folder: Path) -> Plan:
    """The plan of a sweep, and a word where its file says something else by now."""
    from liggghts_driver.sweeps.plan import has_changed, read_plan

    plan = read_plan(folder)
    if has_changed(plan):
        words = "has changed since its points were planned; `sweep run` takes in what was added"
        typer.echo(f"note: {plan.file} {words}", err=True)
    return plan


def _queued(folder: Path, plan: Plan) -> dict[str, str]:
    """Name of a run to the state of its job, where the sweep was submitted to a cluster."""
    from liggghts_driver.sweeps.slurm import points_in_queue, read_submissions

    if not read_submissions(folder):
        return {}
    waiting = points_in_queue(folder)
    return {
        plan.points[index].run: f"job {job}, {state.lower()}"
        for index, (job, state) in waiting.items()
        if index < len(plan.points)
    }


def _report(plan: Plan, place: Place) -> dict[str, int]:
    """Show how the sweep stands; the number of points in each state."""
    from liggghts_driver.cli import show_sweep
    from liggghts_driver.sweeps.status import points_by_state, run_states

    queued = _queued(place.folder, plan)
    states = run_states({point.run for point in plan.points}, place.runs, queued)
    counted = points_by_state(plan, states)
    show_sweep.status(plan, states, counted, place.folder, as_json=place.as_json)
    return {str(state): number for state, number in counted.items()}


def _free_bytes(runs: Path) -> float:
    place = next((p for p in (runs, *runs.parents) if p.exists()), Path())
    return float(shutil.disk_usage(place).free) if place.exists() else math.inf
