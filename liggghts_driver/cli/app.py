"""The commands and their options."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Annotated, Optional

import typer

from liggghts_driver import __version__
from liggghts_driver.cli import show
from liggghts_driver.cli.gradients import parse_gradients
from liggghts_driver.cli.options import (
    CHECKPOINT_EVERY_S,
    Json,
    Overrides,
    SceneFile,
    Tolerance,
    interrupted,
    with_tolerance,
)
from liggghts_driver.cli.paper import paper
from liggghts_driver.cli.progress import follow
from liggghts_driver.cli.study import study
from liggghts_driver.cli.sweep import sweep
from liggghts_driver.scene import read_scene

app = typer.Typer(
    help="Turn a short scene description into a checked answer from the LIGGGHTS engine.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
study.command()(paper)
app.add_typer(study, name="study")
app.add_typer(sweep, name="sweep")

Ranks = Annotated[int, typer.Option("--ranks", min=1, help="MPI processes.")]
Out = Annotated[
    Optional[Path],  # noqa: UP045 - typer reads this form on every Python
    typer.Option("--out", help="Run directory; default: runs/<scene>-<hash>.", show_default=False),
]


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(__version__)
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Turn a short scene description into a checked answer from the LIGGGHTS engine."""
    del version


@app.command()
def run(
    scene: SceneFile,
    ranks: Ranks = 1,
    out: Out = None,
    tolerance: Tolerance = None,
    overrides: Overrides = None,
    as_json: Json = False,
) -> None:
    """Run a scene and report: the main job. Exit code 0 only for a valid answer.

    Ctrl-C ends it at its next checkpoint, a second one at once; the same command goes on.
    """
    from liggghts_driver.engine.stop import Stop
    from liggghts_driver.errors import RunInterrupted
    from liggghts_driver.solve import default_directory, solve

    checked = read_scene(scene, with_tolerance(overrides, tolerance))
    folder = out or default_directory(checked, scene.stem)
    stop = Stop(checkpoint_every_s=CHECKPOINT_EVERY_S)
    try:
        with follow(quiet=as_json) as progress:
            solution = solve(
                checked,
                folder,
                ranks,
                progress.on_case,
                progress.on_step,
                stop,
                on_note=progress.on_note,
            )
    except RunInterrupted as ended:
        interrupted(str(ended), as_json=as_json, run_directory=str(folder))
    except KeyboardInterrupt:
        words = f"interrupted; what the run wrote so far is kept in {folder}"
        interrupted(words, as_json=as_json, run_directory=str(folder))
    _conclude(solution.results, solution.directory.path, reused=solution.reused, as_json=as_json)


@app.command()
def report(
    run_directory: Annotated[Path, typer.Argument(help="A finished run.", show_default=False)],
    as_json: Json = False,
) -> None:
    """Analyse a finished run again and write its report again."""
    from liggghts_driver.solve import load

    solution = load(run_directory)
    _conclude(solution.results, solution.directory.path, reused=True, as_json=as_json)


@app.command()
def deck(
    scene: SceneFile,
    out: Annotated[Path, typer.Option("--out", help="Where to write.", show_default=False)],
    ranks: Ranks = 1,
    overrides: Overrides = None,
    as_json: Json = False,
) -> None:
    """Write the deck and everything that it reads; run nothing."""
    from liggghts_driver.engine.find import BATCH_ARGUMENTS
    from liggghts_driver.solve import write_only

    directory = write_only(read_scene(scene, overrides or ()), out, ranks)
    files = sorted(str(path) for path in directory.path.iterdir() if path.is_file())
    if as_json:
        typer.echo(json.dumps({"files": files}))
        return
    typer.echo("\n".join(files))
    launcher = f"mpirun --bind-to none -np {ranks} " if ranks > 1 else ""
    engine = f"stdbuf -oL liggghts {' '.join(BATCH_ARGUMENTS)}"
    typer.echo(f"run it with: cd {shlex.quote(str(out))} && {launcher}{engine}")


@app.command()
def estimate(
    scene: SceneFile,
    gradient: Annotated[
        Optional[list[str]],  # noqa: UP045
        typer.Option(
            "--gradient",
            metavar="PA_PER_M",
            help="Pressure gradient, several, or a range start:stop:count.",
        ),
    ] = None,
    flow_rate: Annotated[
        Optional[float],  # noqa: UP045
        typer.Option(
            "--flow-rate",
            metavar="M3_PER_S",
            help="Answer backwards: the gradient for this flow rate of the suspension.",
        ),
    ] = None,
    overrides: Overrides = None,
    as_json: Json = False,
) -> None:
    """The Darcy estimate of a scene, at once: equations 1 to 16 of the paper."""
    import numpy as np

    from liggghts_driver.prediction import predict, predict_gradient

    checked = read_scene(scene, overrides or ())
    if flow_rate is not None:
        if gradient:
            raise typer.BadParameter("give --gradient or --flow-rate, not both")
        try:
            with np.errstate(over="ignore"):
                answer = predict_gradient(checked, flow_rate)
        except ValueError as error:
            raise typer.BadParameter(f"--flow-rate {flow_rate:g}: {error}") from None
    else:
        answer = predict(checked, parse_gradients(gradient) if gradient else None)
    show.estimate(answer.as_dict(), as_json=as_json)


@app.command()
def explain(
    scene: SceneFile,
    tolerance: Tolerance = None,
    overrides: Overrides = None,
    as_json: Json = False,
) -> None:
    """Every effect, in or out, and why; the time step and which bound sets it; the size."""
    from liggghts_driver.explain import explain as explain_scene

    checked = read_scene(scene, with_tolerance(overrides, tolerance))
    show.explanation(explain_scene(checked), as_json=as_json)


@app.command()
def doctor(as_json: Json = False) -> None:
    """Find the engine and its launchers; say what is missing and how to install it."""
    from liggghts_driver.engine.doctor import examine

    findings = examine()
    show.doctor(findings, as_json=as_json)
    if not all(finding.found for finding in findings if finding.needed):
        raise typer.Exit(1)


@app.command()
def schema(
    markdown: Annotated[
        bool, typer.Option("--markdown", help="A page for people instead of a JSON schema.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Print what a scene file may say: its JSON schema, or a page of Markdown."""
    from liggghts_driver.scene.schema import scene_reference, scene_schema

    if markdown and as_json:
        raise typer.BadParameter("give --markdown or --json, not both")
    typer.echo(scene_reference() if markdown else json.dumps(scene_schema(), indent=2))


def _conclude(results: dict[str, object], path: Path, *, reused: bool, as_json: bool) -> None:
    show.results(results, path, reused=reused, as_json=as_json)
    if results["verdict"] != "valid":
        raise typer.Exit(1)
