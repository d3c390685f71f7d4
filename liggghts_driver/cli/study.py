"""The studies and their options."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Optional

import typer

from liggghts_driver.cli.options import (
    CHECKPOINT_EVERY_S,
    GOES_ON,
    RUNS,
    Json,
    Overrides,
    Runs,
    SceneFile,
    interrupted,
)
from liggghts_driver.scene import read_problem, read_scene

if TYPE_CHECKING:
    from collections.abc import Sequence

    from liggghts_driver.sweeps.task import Outcome, Task

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
#: Where the study of exact problems is, which has no scene to be named by.
EXACT = Path("runs") / "study-exact"
#: And that of the hard cases, which are many.
STABILITY = Path("runs") / "study-stability"
#: Of a folder's name, which has the names of cases in it.
_LONGEST_NAME = 120

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
    runs: Runs = RUNS,
    replicates: Replicates = 3,
    overrides: Overrides = None,
    as_json: Json = False,
) -> None:
    """Leave each effect out in turn: what it costs and what it changes."""
    from liggghts_driver.cli import show_study
    from liggghts_driver.identity import scene_hash
    from liggghts_driver.outputs import require_study_folder
    from liggghts_driver.studies.effects import study_directory, whole_case, write_results
    from liggghts_driver.studies.measured import measure
    from liggghts_driver.studies.tasks import tasks_in_turn
    from liggghts_driver.studies.variants import variants_of

    checked = read_scene(scene, overrides or ())
    case = whole_case(checked)
    folder = out or study_directory(checked, scene.stem)
    require_study_folder(folder, "effects", scene_hash(checked))
    seeds = [checked.seed + number for number in range(replicates)]
    tasks = tasks_in_turn(variants_of(checked), checked, seeds, runs)
    outcomes = _run(list(tasks.values()), quiet=as_json)
    results = write_results(checked, case, measure(tasks, outcomes), folder, sys.argv)
    show_study.effects(results, folder, as_json=as_json)
    if any(run["failure"] is not None for run in results["runs"]):
        raise typer.Exit(1)


@study.command()
def accuracy(
    scene: SceneFile,
    out: Out = None,
    runs: Runs = RUNS,
    replicates: Replicates = 3,
    knobs: Annotated[
        Optional[str],  # noqa: UP045
        typer.Option(
            "--knobs",
            metavar="KNOB,...",
            help="Run these alone, and the reference (step, drag, stiffness, section, together); "
            "what was run of others before is judged too.",
            show_default=False,
        ),
    ] = None,
    overrides: Overrides = None,
    as_json: Json = False,
) -> None:
    """What accuracy costs in time: each setting's error against its cost."""
    from liggghts_driver.cli import show_study
    from liggghts_driver.identity import scene_hash
    from liggghts_driver.outputs import require_study_folder
    from liggghts_driver.solve import default_directory
    from liggghts_driver.studies.accuracy import measure, require_flow
    from liggghts_driver.studies.accuracy_report import write_results
    from liggghts_driver.studies.knobs import settings_of
    from liggghts_driver.studies.tasks import tasks_in_turn

    wanted = {"reference", *_knobs(knobs)}
    checked = read_problem(scene, overrides or ())
    require_flow(checked)
    folder = out or default_directory(checked, f"study-accuracy-{scene.stem}")
    require_study_folder(folder, "accuracy", scene_hash(checked))
    seeds = [checked.seed + number for number in range(replicates)]
    tasks = tasks_in_turn(settings_of(checked), checked, seeds, runs)
    to_run = [task for (setting, _), task in tasks.items() if setting.knob in wanted]
    outcomes = _run(to_run, quiet=as_json)
    failed = {name: o.reason for name, o in outcomes.items() if o.ending != "done"}
    results = write_results(checked, measure(checked, tasks), folder, failed, sys.argv)
    show_study.accuracy(results, folder, as_json=as_json)
    # A setting may be beyond what holds, which is an answer too; without its reference none is.
    if any(name.startswith("reference") for name in failed):
        raise typer.Exit(1)


def _knobs(text: str | None) -> Sequence[str]:
    """The knobs that an option names; all where it is not given."""
    from liggghts_driver.studies.knobs import KNOBS

    if text is None:
        return KNOBS
    found = [word.strip() for word in text.split(",")]
    unknown = [word for word in found if word not in KNOBS]
    if unknown:
        raise typer.BadParameter(
            f"--knobs {text}: {', '.join(map(repr, unknown))} is none; valid: {', '.join(KNOBS)}"
        )
    return found


def _run(
    tasks: Sequence[Task], *, quiet: bool, name_failures: bool = True, side_by_side: bool = False
) -> dict[str, Outcome]:
    """Run what a study needs, and name what failed, unless it is meant to; how each ended.

    One after another, so that times can be compared, or side by side. An interrupt ends the
    command.
    """
    from liggghts_driver.cli import show_sweep
    from liggghts_driver.engine.find import find_engine
    from liggghts_driver.engine.stop import Stop
    from liggghts_driver.studies.tasks import run_side_by_side, run_tasks, unfinished, untried
    from liggghts_driver.sweeps.local import cores_here

    to_do, cores = unfinished(tasks), 1
    if side_by_side:
        to_do, cores = untried(tasks), len(cores_here())
    if to_do:
        find_engine()  # one message instead of as many failures as there are runs
    stop = Stop(checkpoint_every_s=CHECKPOINT_EVERY_S)
    with show_sweep.following(to_do, cores, quiet=quiet) as listener:
        outcomes = (run_side_by_side if side_by_side else run_tasks)(tasks, stop, listener)
    if stop.asked:
        interrupted(GOES_ON, as_json=quiet)
    for name, outcome in outcomes.items():
        if outcome.ending != "done" and name_failures:
            typer.echo(f"{outcome.ending}: {name}: {outcome.reason}", err=True)
    return outcomes


@study.command()
def exact(
    out: Annotated[
        Path, typer.Option("--out", help="Folder of the study and of its runs.")
    ] = EXACT,
    as_json: Json = False,
) -> None:
    """Problems whose exact answer is known: errors against costs, and their orders.

    Exit code 0 only if every order is as expected.
    """
    from liggghts_driver.cli import show_exact
    from liggghts_driver.outputs import require_study_folder
    from liggghts_driver.studies.exact import measure, tasks_of
    from liggghts_driver.studies.exact_problems import exact_problems
    from liggghts_driver.studies.exact_report import write_results

    require_study_folder(out, "exact")
    problems = exact_problems()
    outcomes = _run(tasks_of(problems, out / "runs"), quiet=as_json)
    failed = {name: o.reason for name, o in outcomes.items() if o.ending != "done"}
    results = write_results(measure(problems, out / "runs"), failed, out, sys.argv)
    show_exact.exact(results, out, as_json=as_json)
    if results["bugs"] or failed:
        raise typer.Exit(1)


@study.command()
def stability(
    cases: Annotated[
        Optional[list[str]],  # noqa: UP045
        typer.Argument(metavar="[CASE]...", help="Names in cases/hard; default: all of them."),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Those that take seconds alone.")] = False,
    no_margin: Annotated[
        bool, typer.Option("--no-margin", help="At their own settings alone, and without the map.")
    ] = False,
    no_broken: Annotated[
        bool, typer.Option("--no-broken", help="Without the cases broken on purpose.")
    ] = False,
    out: Annotated[
        Optional[Path],  # noqa: UP045
        typer.Option(
            "--out",
            help=f"Folder of the study; default: {STABILITY}, and what is chosen of it.",
            show_default=False,
        ),
    ] = None,
    runs: Annotated[
        Optional[Path],  # noqa: UP045
        typer.Option("--runs", help=f"Folder of its runs; default: runs in --out or {STABILITY}."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Hard cases: what comes nearest to breaking in each, and how much larger a step may be.

    Then each is broken on purpose, which must be caught. Exit code 0 only if every case is as
    expected at its own settings, and nothing that was broken hides.
    """
    from liggghts_driver.cli import show_stability
    from liggghts_driver.outputs import require_study_folder
    from liggghts_driver.studies.broken import study_broken
    from liggghts_driver.studies.hard_cases import CASES, hard_cases
    from liggghts_driver.studies.stability import study_stability
    from liggghts_driver.studies.stability_map import run_map
    from liggghts_driver.studies.stability_report import write_results

    try:
        chosen = hard_cases(cases, quick=quick)
    except KeyError as unknown:
        valid = ", ".join(case.name for case in CASES)
        names = ", ".join(map(repr, unknown.args))
        raise typer.BadParameter(f"{names}: no hard case; valid: {valid}") from None
    folder = runs or (out or STABILITY) / "runs"
    chosen_of_it = {"quick": quick, "no-margin": no_margin, "no-broken": no_broken}
    words = [*(cases or ()), *(word for word, given in chosen_of_it.items() if given)]
    place = out or stability_folder(words)
    require_study_folder(place, "stability")
    run = partial(_run, quiet=as_json, name_failures=False)
    studied = study_stability(chosen, folder, run, margins=not no_margin)
    points = [] if no_margin else run_map(folder, run)
    broken = [] if no_broken else study_broken(studied, folder, partial(run, side_by_side=True))
    results = write_results(studied, points, place, broken, sys.argv)
    show_stability.stability(results, place, as_json=as_json)
    if results["broken"] or results["hidden"]:
        raise typer.Exit(1)


def stability_folder(words: Sequence[str]) -> Path:
    """Where the study of stability goes, given what is chosen of it.

    The whole study takes long: a part of it does not take its place.
    """
    return STABILITY.with_name("-".join([STABILITY.name, *words])[:_LONGEST_NAME])
