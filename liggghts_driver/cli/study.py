"""The studies and their options."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Optional

import typer

from liggghts_driver.cli.options import (
    CHECKPOINT_EVERY_S,
    INTERRUPTED,
    RUNS,
    Json,
    Overrides,
    SceneFile,
)
from liggghts_driver.scene import read_scene

Out = Annotated[
    Optional[Path],  # noqa: UP045 - typer reads this form on every Python
    typer.Option(
        "--out",
        help="Folder of the study; default: runs/study-<study>-<scene>-<hash>.",
        show_default=False,
    ),
]
Replicates = Annotated[
    int, typer.Option("--replicates", min=1, help="Seeds, the same for every variant.")
]

study = typer.Typer(
    help="Run a scene many times, with one thing changed at a time.",
    no_args_is_help=True,
    rich_markup_mode=None,
)


@study.callback()
def _studies() -> None:
    """Run a scene many times, with one thing changed at a time."""


@study.command()
def effects(
    scene: SceneFile,
    out: Out = None,
    replicates: Replicates = 3,
    overrides: Overrides = None,
    as_json: Json = False,
) -> None:
    """Leave each effect out in turn: what it costs and what it changes."""
    from liggghts_driver.cli import show_study
    from liggghts_driver.studies.effects import study_directory, study_effects

    checked = read_scene(scene, overrides or ())
    folder = out or study_directory(checked, scene.stem)
    listener = show_study.follower(quiet=as_json)
    try:
        results = study_effects(checked, folder, replicates, listener, command=sys.argv)
    except KeyboardInterrupt:
        typer.echo(
            f"\ninterrupted; finished runs are kept in {folder}, the same command goes on from "
            "there",
            err=True,
        )
        raise typer.Exit(INTERRUPTED) from None
    show_study.effects(results, folder, as_json=as_json)
    if any(run["failure"] is not None for run in results["runs"]):
        raise typer.Exit(1)


@study.command()
def accuracy(
    scene: SceneFile,
    out: Out = None,
    runs: Annotated[
        Path, typer.Option("--runs", help="Folder of all runs, shared with sweeps.")
    ] = RUNS,
    replicates: Replicates = 3,
    overrides: Overrides = None,
    as_json: Json = False,
) -> None:
    """What accuracy costs in time: each setting's error against its cost."""
    from liggghts_driver.cli import show_study, show_sweep
    from liggghts_driver.engine.stop import Stop
    from liggghts_driver.solve import default_directory
    from liggghts_driver.studies.accuracy import measure, require_flow, run_settings, tasks_of
    from liggghts_driver.studies.accuracy_report import write_results

    checked = read_scene(scene, overrides or ())
    require_flow(checked)
    folder = out or default_directory(checked, f"study-accuracy-{scene.stem}")
    tasks = tasks_of(checked, [checked.seed + n for n in range(replicates)], runs)
    stop = Stop(checkpoint_every_s=CHECKPOINT_EVERY_S)
    with show_sweep.following(list(tasks.values()), 1, quiet=as_json) as listener:
        outcomes = run_settings(tasks, stop, listener)
    if stop.asked:
        typer.echo("interrupted; the same command goes on from there", err=True)
        raise typer.Exit(INTERRUPTED)
    failed = {name: o.reason for name, o in outcomes.items() if o.ending != "done"}
    for name, reason in failed.items():
        typer.echo(f"failed: {name}: {reason}", err=True)
    results = write_results(checked, measure(checked, tasks), folder, sys.argv)
    show_study.accuracy(results, folder, as_json=as_json)
    if failed:
        raise typer.Exit(1)
