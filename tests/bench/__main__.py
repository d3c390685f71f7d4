"""Measure what the software claims of its speed, side by side, and write docs/benchmarks.md.

``python -m tests.bench [--repeats N] [--dense RUN_DIR]``; ``make bench``. Without ``--dense`` the
full case is first run to 25 s (some minutes).
"""

from __future__ import annotations

import argparse
import re
import tempfile
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from liggghts_driver.case import make_case
from liggghts_driver.resources import cases_dir
from liggghts_driver.run import run_case
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.scene import read_scene
from tests.bench import drag
from tests.bench.machine import description
from tests.bench.others import lammps_task, yade_task
from tests.bench.timing import Sample, interleave

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from liggghts_driver.case import Case

_PAGE = Path("docs/benchmarks.md")
_FLOWING_AT_S = 6.0
_DENSE_AT_S = 25.0
#: Skins beside the default, over it.
_SKINS = (0.5, 1.0, 2.0)
#: Steps measured for each variant: enough that a measurement lasts a second or more.
_STEPS = {
    "contacts only": 5000,
    "held": 5000,
    "implicit": 5000,
    "held, by addforce": 2000,
    "exact": 250,
    "written by hand": 100,
}
#: Steps of the other codes.
_OTHERS = {"contacts": 300, "drag": 50}
_DENSE_STEPS = {name: max(100, steps // 2) for name, steps in _STEPS.items()}


def main() -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--dense", type=Path, help="a run of cases/infiltration.toml, 25 s or more")
    options = parser.parse_args()
    scene_file = cases_dir() / "infiltration.toml"
    case, dilute = drag.dilute_start(scene_file)
    run = _dense_run(scene_file, options.dense)
    flowing, dense = (drag.later_start(case, run, time) for time in (_FLOWING_AT_S, _DENSE_AT_S))
    parts = [_heading(options.repeats)]
    with tempfile.TemporaryDirectory() as folder:
        for start, steps in ((dilute, _STEPS), (dense, _DENSE_STEPS)):
            parts.append(_schemes(case, start, steps, Path(folder) / start.name, options.repeats))
            parts.append(_ranks(case, start, steps, Path(folder) / start.name, options.repeats))
        parts += [
            _effects(case, start, Path(folder) / start.name, options.repeats)
            for start in (dilute, dense)
        ]
        parts += [
            _skins(case, start, Path(folder) / start.name, options.repeats)
            for start in (dilute, flowing, dense)
        ]
    _PAGE.write_text("\n".join(parts), encoding="utf-8")
    print(f"written: {_PAGE}")


def _dense_run(scene_file: Path, given: Path | None) -> RunDirectory:
    if given is not None:
        return RunDirectory(given)
    overrides = [f"time.duration={_DENSE_AT_S}", "output.frames=25", "output.images=0"]
    case = make_case(read_scene(scene_file, overrides))
    return run_case(case, RunDirectory(Path("runs/bench-dense"))).directory


def _heading(repeats: int) -> str:
    return (
        "# Measured costs\n\n"
        f"Command: `python -m tests.bench --repeats {repeats}` (`make bench` takes five). "
        f"Machine: {description()}.\n"
        f"Each figure is the median of {repeats} repetitions, all variants in turn within one run, "
        "with the smallest and the largest beside it; ratios are taken repetition by repetition. "
        "The engine's start-up is measured and subtracted.\n"
    )


def _schemes(
    case: Case, start: drag.Start, steps: dict[str, int], folder: Path, repeats: int
) -> str:
    """Cost per step of each way of computing the fluid forces."""
    print(f"schemes, {start.name}", flush=True)
    tasks: dict[str, Callable[[], float]] = {}
    for scheme, count in steps.items():
        tasks[scheme] = drag.stepping_task(case, start, scheme, count, folder)
    data = folder / f"contacts only {steps['contacts only']}" / "particles.data"
    counts = dict(steps)
    for name, task, count in _others(data, case, start):
        if task is not None:
            tasks[name], counts[name] = task, count
    per_step = {
        name: _per_step(sample, case, counts[name], name in steps)
        for name, sample in interleave(tasks, repeats).items()
    }
    lines = [
        f"## Fluid forces, full case, {start.name}: milliseconds per step\n",
        "| variant | ms per step | over contacts only | over held |",
        "|---|---|---|---|",
    ]
    for name, sample in per_step.items():
        over = sample.over(per_step["contacts only"]), sample.over(per_step["held"])
        lines.append(f"| {name} | {sample} | {over[0]} | {over[1]} |")
    return "\n".join(lines) + "\n"


def _others(
    data: Path, case: Case, start: drag.Start
) -> Iterator[tuple[str, Callable[[], float] | None, int]]:
    """Name, task and number of steps of the other codes; the task is None where one is missing."""
    step, low = case.time.step_s, start.piston_x_m
    for what, with_drag in (("contacts", False), ("drag", True)):
        count = _OTHERS[what]
        task = lammps_task(data, count, step, low, drag=with_drag)
        yield f"LAMMPS, {'drag by addforce' if with_drag else 'contacts only'}", task, count
        count = _OTHERS["contacts"]
        task = yade_task(data, count, step, drag=with_drag)
        yield f"Yade, {'Stokes drag' if with_drag else 'contacts only'}", task, count


def _per_step(sample: Sample, case: Case, steps: int, whole_refreshes: bool) -> Sample:
    """Milliseconds per step; our variants run whole refresh intervals."""
    every = case.time.refresh_every
    count = every * -(-steps // every) if whole_refreshes else steps
    return Sample(tuple(1e3 * seconds / count for seconds in sample.seconds))


def _ranks(case: Case, start: drag.Start, steps: dict[str, int], folder: Path, repeats: int) -> str:
    """Two ranks beside one, cut across the flow (as the package does) and along it."""
    print(f"ranks, {start.name}", flush=True)

    def task(name: str, ranks: int, edit: Callable[[str], str] = str) -> Callable[[], float]:
        return drag.stepping_task(
            case, start, "held", steps["held"], folder / name, ranks, edit=edit
        )

    tasks = {
        "one": task("one", 1),
        "across": task("across", 2),
        "along": task(
            "along", 2, lambda deck: re.sub(r"(?m)^(processors +).*", r"\g<1>2 1 1", deck)
        ),
    }
    one, across, along = interleave(tasks, repeats).values()
    return (
        f"Two ranks, {start.name}, `held`: {one.over(across)} times as fast as one; with the "
        f"domain cut along the flow, as the engine would, {one.over(along)} times.\n"
    )


def _effects(case: Case, start: drag.Start, folder: Path, repeats: int) -> str:
    """What each effect adds to a step of the contacts alone."""
    print(f"effects, {start.name}", flush=True)
    tasks = {
        name: drag.stepping_task(case, start, name, 2000, folder / "effects")
        for name in ("contacts only", *drag.EFFECTS)
    }
    samples = interleave(tasks, repeats)
    own = samples["contacts only"]
    shown = [f"{name} {sample.over(own)}" for name, sample in samples.items() if sample is not own]
    return f"Effects beside the contacts, {start.name}, over contacts only: {'; '.join(shown)}.\n"


def _skins(case: Case, start: drag.Start, folder: Path, repeats: int) -> str:
    """Other reaches of the neighbour lists, and finer cells to build them with."""
    print(f"neighbour lists, {start.name}", flush=True)
    edits: dict[str, Callable[[str], str]] = {
        f"skin x {factor:g}": partial(_with_skin, factor * case.skin_m) for factor in _SKINS
    }
    cell = 2.0 * float(case.population.particle_radii_m.max()) + case.skin_m
    edits["cells of a particle's size"] = partial(_with_cells, cell)
    tasks = {
        name: drag.stepping_task(case, start, "held", 3000, folder / name, edit=edit)
        for name, edit in edits.items()
    }
    samples = interleave(tasks, repeats)
    own = samples["skin x 1"]
    shown = [f"{name}: {sample.over(own)}" for name, sample in samples.items()]
    return f"Neighbour lists, {start.name}, time over that of the default: {'; '.join(shown)}.\n"


def _with_skin(skin_m: float, deck: str) -> str:
    return re.sub(r"(?m)^(neighbor +)\S+", rf"\g<1>{skin_m!r}", deck)


def _with_cells(size_m: float, deck: str) -> str:
    return re.sub(r"(?m)^(neigh_modify +delay 0)$", rf"\g<1> binsize {size_m!r}", deck)


if __name__ == "__main__":
    main()
