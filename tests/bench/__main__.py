"""Measure what the software claims of its speed, side by side, and write docs/benchmarks.md.

``python -m tests.bench [--repeats N] [--dense RUN_DIR]``; ``make bench``. Without ``--dense`` the
full case is first run to 25 s (some minutes).
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from liggghts_driver.case import make_case
from liggghts_driver.resources import cases_dir
from liggghts_driver.run import run_case
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.scene import read_scene
from tests.bench import drag
from tests.bench.machine import description
from tests.bench.others import yade_task
from tests.bench.timing import Sample, interleave

if TYPE_CHECKING:
    from collections.abc import Callable

    from liggghts_driver.case import Case

_PAGE = Path("docs/benchmarks.md")
_DENSE_AT_S = 25.0
#: Steps measured for each variant: enough that a measurement lasts a second or more.
_STEPS = {
    "contacts only": 4000,
    "implicit": 4000,
    "held": 400,
    "exact": 400,
    "written by hand": 100,
}
_DENSE_STEPS = {name: max(100, steps // 4) for name, steps in _STEPS.items()}


def main() -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--dense", type=Path, help="a run of cases/infiltration.toml, 25 s or more")
    options = parser.parse_args()
    scene_file = cases_dir() / "infiltration.toml"
    case, dilute = drag.dilute_start(scene_file)
    dense = drag.dense_start(case, _dense_run(scene_file, options.dense), _DENSE_AT_S)
    parts = [_heading(options.repeats)]
    with tempfile.TemporaryDirectory() as folder:
        for start, steps in ((dilute, _STEPS), (dense, _DENSE_STEPS)):
            parts.append(_schemes(case, start, steps, Path(folder) / start.name, options.repeats))
            parts.append(_ranks(case, start, steps, Path(folder) / start.name, options.repeats))
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
    for name, with_drag in (("Yade, contacts only", False), ("Yade, Stokes drag", True)):
        task = yade_task(data, 100, case.time.step_s, drag=with_drag)
        if task is not None:
            tasks[name], counts[name] = task, 100
    per_step = {
        name: _per_step(sample, case, counts[name], name in steps)
        for name, sample in interleave(tasks, repeats).items()
    }
    lines = [
        f"## Fluid forces, full case, {start.name}: milliseconds per step\n",
        "| variant | ms per step | over contacts only | over implicit |",
        "|---|---|---|---|",
    ]
    for name, sample in per_step.items():
        over = sample.over(per_step["contacts only"]), sample.over(per_step["implicit"])
        lines.append(f"| {name} | {sample} | {over[0]} | {over[1]} |")
    return "\n".join(lines) + "\n"


def _per_step(sample: Sample, case: Case, steps: int, whole_refreshes: bool) -> Sample:
    """Milliseconds per step; our variants run whole refresh intervals."""
    every = case.time.refresh_every
    count = every * -(-steps // every) if whole_refreshes else steps
    return Sample(tuple(1e3 * seconds / count for seconds in sample.seconds))


def _ranks(case: Case, start: drag.Start, steps: dict[str, int], folder: Path, repeats: int) -> str:
    """Two ranks beside one."""
    print(f"ranks, {start.name}", flush=True)
    count = steps["implicit"]
    tasks = {
        f"{ranks} rank(s)": drag.stepping_task(
            case, start, "implicit", count, folder / f"{ranks} ranks", ranks
        )
        for ranks in (1, 2)
    }
    one, two = interleave(tasks, repeats).values()
    return f"Two ranks, {start.name}, `implicit`: {one.over(two)} times as fast as one.\n"


if __name__ == "__main__":
    main()
