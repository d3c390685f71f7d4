"""From run folders to what is stored: every point of every sweep, also those without an answer."""

from __future__ import annotations

import json
import platform
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from liggghts_driver.errors import ParseError
from liggghts_driver.identity import scene_hash
from liggghts_driver.machine import this_machine
from liggghts_driver.paper.catalogue import SWEEPS, sweep_file
from liggghts_driver.paper.decks import deck_sha256_in
from liggghts_driver.paper.speeds import mean_speeds_m_s
from liggghts_driver.paper.stored import (
    NOT_RUN,
    Answer,
    Curves,
    Measured,
    Point,
    Stored,
    SweepResults,
)
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.sweeps.model import read_sweep
from liggghts_driver.sweeps.plan import make_plan
from liggghts_driver.sweeps.status import run_states

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from liggghts_driver.sweeps.plan import Plan
    from liggghts_driver.sweeps.plan import Point as PlannedPoint
    from liggghts_driver.sweeps.status import RunState

#: About as many samples of a curve are kept.
_SAMPLES = 100
#: Digits that are kept of a measured number.
_DIGITS = 6


def collect(runs: Path, earlier: Stored | None = None) -> Stored:
    """Everything that the runs of the shipped sweeps say.

    Parameters
    ----------
    runs
        The folder of all runs.
    earlier
        What was stored before: a point whose run is not in that folder, or is not finished there,
        keeps what is known of it, as long as it is the same scene.
    """
    known = {} if earlier is None else {p.scene_sha256: p for p in earlier.points()}
    found = {}
    for name in SWEEPS:
        path = sweep_file(name)
        settings = dict(read_sweep(path).sweep.settings)
        plan = make_plan(path)
        found[name] = SweepResults(name, plan.title, settings, collect_points(plan, runs, known))
    return Stored(found)


def collect_points(
    plan: Plan, runs: Path, known: Mapping[str, Point] | None = None
) -> tuple[Point, ...]:
    """The points of a plan, in its order; ``known`` is by the hash of the scene."""
    states = run_states({point.run for point in plan.points}, runs)
    points = []
    for planned in plan.points:
        new = _point(plan, planned, states[planned.run], RunDirectory(runs / planned.run))
        old = (known or {}).get(new.scene_sha256)
        waits = new.state == "unfinished"
        if waits and old is not None and old.answer is not None:
            new = replace(new, state=old.state, why=old.why, answer=old.answer)
        points.append(new)
    return tuple(points)


def _point(plan: Plan, planned: PlannedPoint, state: RunState, run: RunDirectory) -> Point:
    """What is known of a point."""
    shared: dict[str, Any] = {
        "values": dict(planned.values),
        "replicate": planned.replicate,
        "seed": planned.seed,
        "ranks": planned.ranks,
        "run": planned.run,
        "scene_sha256": scene_hash(plan.scene(planned)),
    }
    if state.state == "failed":
        return Point(**shared, state="failed", why=state.reason)
    if state.state != "done":
        begun = run.state.exists()
        return Point(**shared, why="not finished yet" if begun else NOT_RUN)
    try:
        return Point(**shared, state="done", why="", answer=_answer(run))
    except (OSError, ValueError, LookupError, ParseError) as error:
        why = f"its answer cannot be read ({type(error).__name__}: {error})"
        return Point(**shared, state="failed", why=why)


def _answer(run: RunDirectory) -> Answer:
    results = json.loads(run.results.read_text(encoding="utf-8"))
    series = pd.read_csv(run.series)
    sections = results["sections"]
    return Answer(
        verdict=results["verdict"],
        reasons=results["reasons"],
        flow_m3_s={
            name: _measured(found["particle_flow_rate_m3_s"]) for name, found in sections.items()
        },
        velocity_m_s=_measured(results["flowing_velocity_m_s"]),
        velocity_range_m_s=_range(series),
        reached_s={name: _reached(series, f"volume_{name}_m3") for name in sections},
        inside=int(series["inside"].iloc[-1]),
        flowing=int(series["flowing"].iloc[-1]),
        curves=_curves(series, sections),
        cost=_cost(results),
        provenance=_provenance(results, run),
        faster_m_s={name: float(f"{v:.3g}") for name, v in mean_speeds_m_s(run).items()},
    )


def _measured(found: Mapping[str, Any]) -> Measured:
    return Measured(
        mean=_short(found.get("mean")),
        ci95=_short(found.get("ci95")),
        steady=bool(found.get("steady")),
        from_s=found.get("steady_from_s", 0.0),
        reason=found.get("reason", "nothing flows"),
    )


def _short(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.{_DIGITS}g}")


def _range(series: pd.DataFrame) -> tuple[float, float] | None:
    """Smallest and largest velocity of the flowing particles over the second half."""
    half = series.loc[series["time_s"] >= series["time_s"].iloc[-1] / 2, "flowing_velocity_m_s"]
    low, high = _short(half.min()), _short(half.max())
    return None if low is None or high is None or np.isnan(low) else (low, high)


def _reached(series: pd.DataFrame, column: str) -> float | None:
    past = series.loc[series[column] > 0.0, "time_s"]
    return _short(float(past.iloc[0])) if len(past) else None


def _curves(series: pd.DataFrame, sections: Mapping[str, Any]) -> Curves:
    every = max(1, round((len(series) - 1) / _SAMPLES))
    thin = series.iloc[::every]
    return Curves(
        interval_s=float(f"{thin['time_s'].iloc[1] - thin['time_s'].iloc[0]:.{_DIGITS}g}"),
        volume_mm3={name: _whole(thin[f"volume_{name}_m3"], 1e-9) for name in sections},
        piston_x_um=_whole(thin["piston_x_m"], 1e-6),
    )


def _whole(values: pd.Series[float], unit: float) -> list[int]:
    return [round(value / unit) for value in values]


def _cost(results: Mapping[str, Any]) -> dict[str, Any]:
    cost = results["cost"]
    return {
        "cpu_s": _short(cost["cpu_s"]),
        "wall_s": _short(cost["wall_s"]),
        "simulated_s": _short(results["time_step_s"] * cost["steps"]),
        "step_s": results["time_step_s"],
        "ranks": cost["ranks"],
        "particles": cost["particles"],
    }


def _provenance(results: Mapping[str, Any], run: RunDirectory) -> dict[str, Any]:
    made, state = results["provenance"], run.read_state()
    here = state.get("host") == platform.node()
    return {
        "deck_sha256": deck_sha256_in(run),
        "engine": made["engine"],
        "liggghts_driver": made["liggghts_driver"],
        "started": state.get("started"),
        # Of another machine nothing is known but its name.
        "machine": this_machine() if here else None,
    }
