"""The points of a plan as tasks: each run once, and only those that are still to be done."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from liggghts_driver.sweeps.task import Task

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from liggghts_driver.sweeps.plan import Plan, Point
    from liggghts_driver.sweeps.status import RunState


def label(point: Point) -> str:
    """A point's name for people: what sets it apart."""
    values = ", ".join(f"{key} = {_short(value)}" for key, value in point.values.items())
    return f"{values}, seed {point.seed}" if values else f"seed {point.seed}"


def task_of(plan: Plan, point: Point, runs: Path) -> Task:
    """A point as a task."""
    cost = plan.costs.get(point.run)
    return Task(
        name=label(point),
        scene=partial(plan.scene, point),
        folder=runs / point.run,
        ranks=point.ranks,
        cost_s=cost.core_s_packed if cost else 0.0,
    )


def to_do(plan: Plan, states: Mapping[str, RunState], retries: int) -> list[Point]:
    """Points whose runs are to be done, one for each run, in the order of the plan."""
    first = {point.run: point for point in reversed(plan.points)}
    wanted = {run for run, state in states.items() if _is_to_do(state, retries)}
    return [point for point in plan.points if first[point.run] is point and point.run in wanted]


def _is_to_do(state: RunState, retries: int) -> bool:
    if state.state == "failed":
        return state.failures <= retries and not state.hopeless
    return state.state in ("waiting", "interrupted", "lost")


def _short(value: object) -> str:
    return f"{value:.12g}" if isinstance(value, float) else str(value)
