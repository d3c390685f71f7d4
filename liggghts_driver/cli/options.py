"""What several commands have in common: their options, and the exit code of an interrupt."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, NoReturn, Optional

import typer

from liggghts_driver.cli import EXIT_INTERRUPTED


class _Told(int):
    """An exit code that comes with a message already."""


#: What is said of a command that goes on with what it began.
GOES_ON = "interrupted; the same command goes on from there"
#: Exit code of a program that Ctrl-C ended, and that said so.
INTERRUPTED = _Told(EXIT_INTERRUPTED)
#: Wall time between two checkpoints: a crash of the machine costs a run no more than this.
CHECKPOINT_EVERY_S = 900.0

#: Where the runs of all sweeps are.
RUNS = Path("runs") / "points"

SceneFile = Annotated[Path, typer.Argument(help="Scene file (TOML).", show_default=False)]
Overrides = Annotated[
    Optional[list[str]],  # noqa: UP045 - typer reads this form on every Python
    typer.Option("--set", metavar="SECTION.KEY=VALUE", help="Override a key of the scene."),
]
Tolerance = Annotated[
    Optional[float],  # noqa: UP045
    typer.Option(
        "--tolerance",
        metavar="ERROR",
        help="Relative error to tolerate, as 0.05: takes the cheapest settings that a study of the "
        "scene's accuracy found to be within. Instead of the scene's own accuracy.",
        show_default=False,
    ),
]
Runs = Annotated[
    Path, typer.Option("--runs", help="Folder of all runs, shared by sweeps and studies.")
]
Cores = Annotated[
    Optional[int],  # noqa: UP045
    typer.Option("--cores", min=1, help="Cores to use here; default: all.", show_default=False),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else.")]


def interrupted(words: str, *, as_json: bool = False, **facts: str) -> NoReturn:
    """Say that a command was interrupted, and end it; as a document where it has none yet."""
    if as_json:
        typer.echo(json.dumps({"interrupted": words, **facts}, indent=2))
    typer.echo(words, err=True)
    raise typer.Exit(INTERRUPTED)


def with_tolerance(overrides: list[str] | None, tolerance: float | None) -> list[str]:
    """Overrides and the tolerance, which is the scene's ``accuracy`` as a number."""
    return [*(overrides or ()), *([] if tolerance is None else [f"accuracy={tolerance!r}"])]
