"""Made-up results of the paper's sweeps, for tests of what is said of them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

from liggghts_driver.paper.catalogue import GRADIENT, SWEEPS, sweep_file
from liggghts_driver.paper.stored import Answer, Curves, Measured, Point, Stored, SweepResults
from liggghts_driver.sweeps.plan import make_plan

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    #: Sweep, values of a point and number of its packing to a flow rate; None: it has not run.
    Rule = Callable[[str, dict[str, Any], int], float | None]

SAMPLES, INTERVAL_S = 100, 0.5


def measured(mean: float | None, ci95: float | None = None, *, steady: bool = True) -> Measured:
    return Measured(mean, ci95, steady, 25.0, "no drift" if steady else "drifts: a made-up drift")


def answer(
    entrance_m3_s: float,
    middle_m3_s: float | None = None,
    verdict: str = "valid",
    velocity_m_s: float = 2e-3,
) -> Answer:
    """A run with constant flow rates."""
    flows = {
        "entrance": entrance_m3_s,
        "middle": 0.8 * entrance_m3_s if middle_m3_s is None else middle_m3_s,
    }
    times = [n * INTERVAL_S for n in range(SAMPLES)]
    return Answer(
        verdict=verdict,
        reasons=[] if verdict == "valid" else ["a made-up reason"],
        flow_m3_s={
            name: measured(rate, 0.02 * rate, steady=verdict != "not_steady")
            for name, rate in flows.items()
        },
        velocity_m_s=measured(velocity_m_s, 0.02 * velocity_m_s),
        velocity_range_m_s=(0.9 * velocity_m_s, 1.1 * velocity_m_s),
        reached_s={"entrance": 1.0, "middle": 12.0 if flows["middle"] else None},
        inside=8000,
        flowing=6000,
        curves=Curves(
            INTERVAL_S,
            {name: [round(1e9 * rate * t) for t in times] for name, rate in flows.items()},
            [round(-205_000 + 1000 * t) for t in times],
        ),
        cost={
            "cpu_s": 800.0,
            "wall_s": 900.0,
            "simulated_s": 50.0,
            "step_s": 5e-4,
            "ranks": 1,
            "particles": 21_500,
        },
        provenance={
            "deck_sha256": "d" * 64,
            "engine": "LIGGGHTS-PUBLIC 3.8.0",
            "liggghts_driver": "0.1.0",
            "started": "2026-01-02T03:04:05+0000",
            "machine": {"cpu": "A made-up processor", "cores": 4},
        },
    )


def point(values: dict[str, Any], replicate: int = 0, found: Answer | None = None) -> Point:
    name = f"{replicate}-{values}"
    shared = {"values": values, "replicate": replicate, "seed": 1 + replicate, "ranks": 1}
    if found is None:
        return Point(**shared, run=name, scene_sha256=name)
    return Point(**shared, run=name, scene_sha256=name, state="done", why="", answer=found)


def only(sweep: str, points: Iterable[Point]) -> Stored:
    """The results of one sweep alone."""
    return Stored({sweep: SweepResults(sweep, "made up", {}, tuple(points))})


def shipped(rule: Rule) -> Stored:
    """Every point of the shipped sweeps, with the flow rates of a rule."""
    found = {}
    for name in SWEEPS:
        plan = make_plan(sweep_file(name))
        points = []
        for planned in plan.points:
            values = dict(planned.values)
            flow = rule(name, values, planned.replicate)
            made = point(values, planned.replicate, None if flow is None else answer(flow))
            points.append(made)
        found[name] = SweepResults(name, plan.title, {"time.step": 5e-4}, tuple(points))
    return Stored(found)


def power_law(exponent: float, at_ten: float = 1.9e-6) -> Rule:
    """Flow rates that go with a power of the gradient; packings differ, in the power by 0.02."""

    def rule(sweep: str, values: dict[str, Any], replicate: int) -> float:
        gradient = float(values.get(GRADIENT, 10.0))
        power = exponent + 0.02 * (replicate - 1)
        chance = 0.03 * (replicate - 1) + 0.01 * replicate * (len(sweep) % 3)
        return at_ten * (gradient / 10.0) ** power * (1.0 + chance)

    return rule


@cache
def linear() -> Stored:
    """All runs there, the flow proportional to the gradient; at 10 Pa/m nearly the paper's."""
    return shipped(power_law(1.0))


@cache
def as_free_flight() -> Stored:
    """All runs there, the flow with the power of the gradient that a lone particle has."""
    return shipped(power_law(0.74, at_ten=1.2e-6))


def with_points(stored: Stored, name: str, points: tuple[Point, ...]) -> SweepResults:
    """A sweep of some results with other points in it."""
    return replace(stored.sweeps[name], points=points)


def every(made: Callable[[str, int], Answer | None]) -> Stored:
    """An answer for each sweep and packing."""
    sweeps = {
        name: tuple(point(p.values, p.replicate, made(name, p.replicate)) for p in sweep.points)
        for name, sweep in linear().sweeps.items()
    }
    return Stored({n: with_points(linear(), n, points) for n, points in sweeps.items()})
