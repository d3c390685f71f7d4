"""Measure what sweeps cost beside the engine, and write docs/benchmarks-sweeps.md.

``python -m tests.bench.sweeps [--repeats N]``; a part of ``make bench``.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from liggghts_driver.engine.stop import Stop
from liggghts_driver.resources import cases_dir
from liggghts_driver.sweeps.local import cores_here, run_local
from liggghts_driver.sweeps.plan import make_plan, read_plan, write_plan
from liggghts_driver.sweeps.status import run_states
from liggghts_driver.sweeps.tasks import task_of
from tests.bench.machine import description
from tests.bench.timing import Sample

if TYPE_CHECKING:
    from collections.abc import Callable

_PAGE = Path("docs/benchmarks-sweeps.md")
#: Points of the sweep whose overhead is measured; each is a collision, the shortest run there is.
_POINTS = 40
_PLANNED = 1000
_LOOKED_AT = 20_000


def main() -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    repeats = parser.parse_args().repeats
    with tempfile.TemporaryDirectory() as name:
        rows = _rows(Path(name), repeats)
    lines = [
        "# Measured costs of sweeps",
        "",
        (
            f"Command: `python -m tests.bench.sweeps --repeats {repeats}` (part of `make bench`). "
            f"Machine: {description()}. Each figure is the median of {repeats} repetitions, with "
            "the smallest and the largest beside it."
        ),
        "",
        "| what | measured | wanted |",
        "|---|---|---|",
        *(f"| {what} | {sample} s | {wanted} |" for what, sample, wanted in rows),
        "",
        (
            "Time beside the engine's own: wall time of the sweep times the cores it used, less "
            "the wall time of all engines (their start-up, about a quarter of a second, is the "
            "engine's), over the number of points. Placing spheres, writing decks, proving runs "
            "whole and analysing them is in it; reports are not, `sweep collect` writes those "
            "that are missing."
        ),
        "",
    ]
    _PAGE.write_text("\n".join(lines), encoding="utf-8")
    print(f"written: {_PAGE}")


def _rows(folder: Path, repeats: int) -> list[tuple[str, Sample, str]]:
    cores = cores_here()
    measured: list[tuple[str, Callable[[int], float], str]] = [
        (
            f"time beside the engine's own per point, {_POINTS} points, one core",
            lambda turn: _overhead_s(folder / f"one-{turn}", cores[:1]),
            "below 0.15 s",
        ),
        (
            f"the same on {len(cores)} cores",
            lambda turn: _overhead_s(folder / f"all-{turn}", cores),
            "below 0.15 s",
        ),
        (
            f"planning {_PLANNED} points, every scene checked and its cost predicted",
            lambda _turn: _planning_s(folder),
            "below 2 s",
        ),
        (
            f"reading the plan and the state of {_LOOKED_AT:,} runs",
            lambda _turn: _status_s(folder / "runs", folder),
            "below 1 s",
        ),
        (
            "the same as a command, `sweep status --json`, the program's start included",
            lambda _turn: _status_command_s(folder / "runs", folder),
            "",
        ),
    ]
    _many_runs(folder)
    taken: dict[str, list[float]] = {what: [] for what, _, _ in measured}
    for turn in range(repeats + 1):  # all in turn; the first does not count
        for what, measure, _ in measured:
            seconds = measure(turn)
            print(f"  turn {turn}: {what}: {seconds:.3f} s", flush=True)
            if turn:
                taken[what].append(seconds)
    return [(what, Sample(tuple(taken[what])), wanted) for what, _, wanted in measured]


def _sweep_file(folder: Path, scene: dict[str, Any], count: int) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scene.json").write_text(json.dumps(scene), encoding="utf-8")
    file = folder / f"{count}.toml"
    axis = f'[[axes]]\nkey = "contact.restitution"\nfrom = 0.2\nto = 0.9\ncount = {count}\n'
    file.write_text(f'scene = "scene.json"\n{axis}', encoding="utf-8")
    return file


def _collision() -> dict[str, Any]:
    sphere = {"radius": 0.0015, "velocity": [0.005, 0.0, 0.0], "position": [-0.0016, 0.0, 0.0]}
    other = sphere | {"velocity": [-0.005, 0.0, 0.0], "position": [0.0016, 0.0, 0.0]}
    return {
        "particles": {"density": 7000.0, "youngs_modulus": 1.0e7, "poissons_ratio": 0.25},
        "spheres": [sphere, other],
        "contact": {"restitution": 0.5},
        "box": {"low": [-0.02, -0.005, -0.005], "high": [0.02, 0.005, 0.005]},
        "time": {"duration": 0.1},
        "output": {"samples": 20, "frames": 5, "images": 0},
    }


def _overhead_s(folder: Path, cores: list[int]) -> float:
    plan = make_plan(_sweep_file(folder, _collision(), _POINTS))
    tasks = [task_of(plan, point, folder / "runs") for point in plan.points]
    start = time.perf_counter()
    outcomes = run_local(tasks, Stop(), cores=cores)
    wall_s = time.perf_counter() - start
    assert {outcome.ending for outcome in outcomes.values()} == {"done"}
    states = (json.loads((task.folder / "run.json").read_text()) for task in tasks)
    return (wall_s * len(cores) - sum(state["wall_s"] for state in states)) / len(tasks)


def _planning_s(folder: Path) -> float:

    case = (cases_dir() / "infiltration_small.toml").read_text(encoding="utf-8")
    scene = tomllib.loads(case)
    del scene["contact"]["damping_ratio"]
    scene["contact"]["restitution"] = 0.5
    file = _sweep_file(folder / "planned", scene, _PLANNED)
    start = time.perf_counter()
    plan = make_plan(file)
    seconds = time.perf_counter() - start
    assert len(plan.points) == _PLANNED
    return seconds


def _many_runs(folder: Path) -> None:
    """A plan of so many points and their run directories, in every state there is."""
    file = _sweep_file(folder, _collision(), 2000)
    text = f"replicates = {_LOOKED_AT // 2000}\n{file.read_text(encoding='utf-8')}"
    file.write_text(text, encoding="utf-8")
    plan = make_plan(file)
    write_plan(plan, folder)
    state = {"host": "elsewhere", "pid": 1, "command": ["liggghts"] * 12, "engine": "3.8.0"}
    claim = {"host": "elsewhere", "pid": 1, "started": 1, "job": None}
    for point in plan.points:
        kind = ("complete", "running", "failed", "interrupted", "absent")[point.index % 5]
        run = folder / "runs" / point.run
        if kind == "absent":
            continue
        run.mkdir(parents=True)
        facts = {**state, "state": kind, "failures": 1, "continuations": 0, "faults": ["why"]}
        (run / "run.json").write_text(json.dumps(facts, indent=2), encoding="utf-8")
        if kind == "complete":
            (run / "results.json").write_text("{}", encoding="utf-8")
        if kind == "running":
            (run / "claim.json").write_text(json.dumps(claim), encoding="utf-8")


def _status_s(runs: Path, folder: Path) -> float:
    start = time.perf_counter()
    plan = read_plan(folder)
    states = run_states({point.run for point in plan.points}, runs)
    seconds = time.perf_counter() - start
    assert len(states) == _LOOKED_AT
    return seconds


def _status_command_s(runs: Path, folder: Path) -> float:
    words = [sys.executable, "-m", "liggghts_driver", "sweep", "status", str(folder)]
    start = time.perf_counter()
    done = subprocess.run([*words, "--runs", str(runs), "--json"], capture_output=True, check=True)
    seconds = time.perf_counter() - start
    assert json.loads(done.stdout)["points"]["done"] == _LOOKED_AT // 5
    return seconds


if __name__ == "__main__":
    main()
