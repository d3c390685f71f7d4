"""The studies and their options."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Optional

import typer

from liggghts_driver.cli.options import INTERRUPTED, Json, Overrides, SceneFile
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
