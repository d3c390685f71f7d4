"""The tables that hold the simulation against theory: the estimate's, and exact answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from liggghts_driver.report.numbers import Unit, decimals_for, fixed, number, unit_for

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

#: Exact checks in words, with the dimension of those that have one.
_CHECKS = {
    "free_flight_velocity_m_s": ("Velocity of free flight", "m/s"),
    "momentum_drift_over_scale": ("Drift of the momentum, over its scale", None),
    "restitution": ("Coefficient of restitution", None),
}


@dataclass(frozen=True)
class Cell:
    """A number of a table: its text, and the value in SI behind it (None: there is none)."""

    text: str
    value: float | None


@dataclass(frozen=True)
class Row:
    """A quantity of the simulation beside what theory says; ``unit`` is that of the texts."""

    label: str
    unit: str
    steady: bool
    simulated: Cell
    interval: Cell
    theory: Cell
    ratio: Cell
    z_score: Cell


def comparison_rows(results: Mapping[str, Any]) -> list[Row]:
    """Flow rate through each section and mean velocity, beside the estimate where it applies."""
    compared = results["comparison"]
    return [
        _measured(label, dimension, part, compared.get(name, {}))
        for name, label, dimension, part in _parts(results)
    ]


def exact_rows(results: Mapping[str, Any]) -> list[Row]:
    """Every exact answer that the scene has, beside what the run gave."""
    return [_exact(check) for check in results["exact"]]


def _exact(check: Mapping[str, Any]) -> Row:
    label, dimension = _CHECKS.get(check["name"], (check["name"], None))
    simulated, theory, ratio = check["simulated"], check["exact"], check["ratio"]
    unit = Unit("", 1.0) if dimension is None else unit_for(dimension, abs(theory))
    return Row(
        label=label,
        unit=unit.name,
        steady=True,
        simulated=Cell(number(_in(unit, simulated), 6), simulated),
        interval=Cell("", None),
        theory=Cell(number(_in(unit, theory), 6), theory),
        ratio=Cell(number(ratio, 6), ratio),
        z_score=Cell("", None),
    )


def steadiness(results: Mapping[str, Any]) -> list[str]:
    """On what part of the run each mean rests, and what speaks for or against its being steady."""
    sections = results["sections"].values()
    end = max((part["particle_flow_rate_m3_s"]["steady_to_s"] for part in sections), default=0.0)
    return [
        f"{label}, {number(part['steady_from_s'])} to {number(end)} s: {part['reason']}."
        for _, label, _, part in _parts(results)
    ]


def _parts(results: Mapping[str, Any]) -> Iterator[tuple[str, str, str, Mapping[str, Any]]]:
    """Name, label, dimension and findings of each quantity that has an estimate."""
    for name, section in results["sections"].items():
        yield name, f"Particle flow rate, {name}", "m³/s", section["particle_flow_rate_m3_s"]
    if results["flowing_velocity_m_s"]:
        label = "Mean velocity of the flowing particles"
        yield "flowing_velocity", label, "m/s", results["flowing_velocity_m_s"]


def _measured(
    label: str, dimension: str, measured: Mapping[str, Any], compared: Mapping[str, Any]
) -> Row:
    mean, ci95, estimated = measured["mean"], measured["ci95"], compared.get("estimated")
    unit = unit_for(dimension, max(abs(mean or 0.0), abs(estimated or 0.0)))
    decimals = None if ci95 is None else decimals_for(unit.of(ci95))
    z_score = compared.get("z_score")
    interval = fixed(_in(unit, ci95), decimals)
    return Row(
        label=label,
        unit=unit.name,
        steady=measured["steady"],
        simulated=Cell(fixed(_in(unit, mean), decimals), mean),
        interval=Cell(interval if ci95 is None else f"± {interval}", ci95),
        theory=Cell(number(_in(unit, estimated)), estimated),
        ratio=Cell(number(compared.get("ratio")), compared.get("ratio")),
        z_score=Cell(number(z_score, 2), z_score),
    )


def _in(unit: Unit, value: float | None) -> float | None:
    return None if value is None else unit.of(value)
