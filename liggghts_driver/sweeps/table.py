"""Every point of a sweep as a row: its place on the axes, how its run went, what came out.

A numeric column ends with its unit, as in ``results.json``: ``flow_rate_middle_ci95_m3_s``.
"""

from __future__ import annotations

import json
import os
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import pandas as pd

from liggghts_driver.effects import EFFECTS
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.scene.layout import layout
from liggghts_driver.scene.model import Scene, table_class

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    from liggghts_driver.sweeps.plan import Plan, Point

_HEAD = {
    "point": "int64",
    "run": "string",
    "replicate": "int64",
    "seed": "int64",
    "ranks": "int64",
}
_RUN = {
    "state": "string",
    "reason": "string",
    "verdict": "string",
    "reasons": "string",
}
_COST = {
    "max_overlap_over_radius": "float64",
    "step_s": "float64",
    "steps": "Int64",
    "wall_s": "float64",
    "core_s": "float64",
    "particle_steps_per_s": "float64",
    "failures": "Int64",
    "continuations": "Int64",
    "driver_version": "string",
    "engine_version": "string",
}
#: In words, what a run is whose engine has ended and whose results are not there.
_STATES = {"absent": "waiting", "complete": "interrupted", "unreadable": "failed"}
_REASONS = {
    "complete": "the engine finished, but there is no answer yet; run the sweep again",
    "unreadable": "run.json cannot be read",
    "failed": "no reason was recorded",
}
#: A row of a series is shorter than this many bytes.
_ROW_BYTES = 8192


@dataclass(frozen=True)
class Result:
    """Something that runs give: how its columns are called, and how people call it.

    Attributes
    ----------
    stem, unit
        Its columns are the stem, perhaps a part of it such as ``ci95``, and the unit.
    title
        For people.
    theory
        The column of what theory says; empty where there is none.
    field
        The field of the Darcy estimate behind that; empty for an exact answer.
    """

    stem: str
    unit: str
    title: str
    theory: str = ""
    field: str = ""

    @property
    def name(self) -> str:
        """How other columns call it: ``ratio_entrance``."""
        return self.stem.removeprefix("flow_rate_")

    @property
    def column(self) -> str:
        """The column of its value."""
        return self.stem + suffix(self.unit)

    def part(self, name: str) -> str:
        """The column of a part of it in its own unit: ``ci95``."""
        return f"{self.stem}_{name}{suffix(self.unit)}"

    def variance(self, name: str) -> str:
        """The column of a variance of it, in its unit squared."""
        double = re.sub(r"([a-z])(\d?)", lambda m: f"{m[1]}{2 * int(m[2] or 1)}", self.unit)
        return f"{self.stem}_variance_{name}{suffix(double)}"


@lru_cache(maxsize=256)
def suffix(unit: str) -> str:
    """How a unit ends the name of a column: ``Pa/m`` makes ``_pa_m``, none makes nothing."""
    return "_" + re.sub(r"[ /]+", "_", unit.lower()) if unit else ""


@lru_cache(maxsize=256)
def axis_unit(key: str) -> str:
    """The unit of a key of the scene; ``""`` for a pure number, a word or a table.

    Raises
    ------
    KeyError
        If there is no such key.
    """
    *tables, last = re.sub(r"\[\d+\]", "", key).split(".")
    if tables[:2] == ["effects", "settings"]:
        settings = {f"{e.name}.{name}": s.unit for e in EFFECTS for name, s in e.settings.items()}
        return settings.get(f"{tables[-1]}.{last}", "")  # a whole table has no unit
    table: Any = Scene
    for name in tables:
        table = table_class(table.model_fields[name].annotation)
    extra = table.model_fields[last].json_schema_extra
    return str(extra.get("unit", "")) if isinstance(extra, dict) else ""


def axis_column(key: str) -> str:
    """The column of an axis: ``pressure.gradient`` makes ``pressure_gradient_pa_m``."""
    return "_".join(re.findall(r"\w+", key)) + suffix(axis_unit(key))


def results_in(columns: Iterable[str]) -> tuple[Result, ...]:
    """The results with an answer of theory, as figures and the page show them, in their order."""
    names = list(columns)
    sections = [m[1] for name in names if (m := re.fullmatch(r"flow_rate_(\w+)_ci95_m3_s", name))]
    exact = [m[1] for name in names if (m := re.fullmatch(r"exact_(\w+)", name))]
    found = [_flow(section) for section in sections]
    return (*found, *([_VELOCITY] if sections else []), *map(_exact, exact))


_VELOCITY = Result(
    "flowing_velocity",
    "m/s",
    "velocity of the flowing particles",
    "estimate_flowing_velocity_m_s",
    "pore_velocity_m_s",
)


def _flow(section: str) -> Result:
    theory, field = "estimate_flow_rate_m3_s", "particle_flow_rate_m3_s"
    return Result(f"flow_rate_{section}", "m3/s", f"particle flow rate, {section}", theory, field)


def _exact(name: str) -> Result:
    stem = name.removesuffix("_m_s")
    unit = "m/s" if stem != name else ""
    return Result(stem, unit, stem.replace("_", " "), f"exact_{name}")


def points_table(plan: Plan, runs_folder: Path) -> pd.DataFrame:
    """One row for each point of a plan, whether it has run or not.

    Columns
    -------
    ``point``, ``run``, ``replicate``, ``seed``; one for each axis (see ``axis_column``);
    ``state`` (done, running, waiting, failed, interrupted) with the first fault as ``reason``;
    ``verdict`` with its ``reasons``; the results, empty where there are none; what the run cost.
    Columns and their types are those of the plan, also when no run has ended, save exact answers,
    which are columns once a run has one.
    """
    sections = tuple(layout(plan.scene(plan.points[0])).sections)
    rows = [_row(point, RunDirectory(runs_folder / point.run), sections) for point in plan.points]
    exact = dict.fromkeys(name for row in rows for name in row["exact"])
    for row in rows:
        row |= row.pop("exact")
    values = [point.values for point in plan.points]  # noqa: PD011 - not those of a table
    places = {axis_column(key): _place([v.get(key) for v in values]) for key in plan.axes}
    types = {**_RUN, **_result_types(sections), **dict.fromkeys(exact, "float64"), **_COST}
    found = {name: _column(rows, name, dtype) for name, dtype in types.items()}
    head = {name: _column(rows, name, dtype) for name, dtype in _HEAD.items()}
    return pd.DataFrame(head | places | found)


def _column(rows: Sequence[Mapping[str, Any]], name: str, dtype: str) -> pd.Series[Any]:
    return pd.Series([row.get(name) for row in rows], dtype=dtype)


def _place(values: Sequence[Any]) -> pd.Series[Any]:
    """Values of an axis: numbers as numbers, anything else as text."""
    if all(isinstance(value, bool) for value in values):
        return pd.Series(values, dtype="bool")
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        whole = all(isinstance(value, int) for value in values)
        return pd.Series(values, dtype="int64" if whole else "float64")
    texts = [value if isinstance(value, str) else json.dumps(value) for value in values]
    return pd.Series(texts, dtype="string")


def _result_types(sections: Iterable[str]) -> dict[str, str]:
    """Results of a scene with such sections; none without, where nothing flows."""
    types: dict[str, str] = {}
    names = [_flow(section) for section in sections]
    for result in [*names, *([_VELOCITY] if names else [])]:
        types |= {result.column: "float64", result.part("ci95"): "float64"}
        types |= {f"{result.stem}_steady": "boolean"}
        types |= {f"ratio_{result.name}": "float64", f"ratio_{result.name}_ci95": "float64"}
        types |= {f"z_score_{result.name}": "float64"}
        if result != _VELOCITY:
            types |= {f"volume_end_{result.name}_m3": "float64"}
    if names:
        types |= {_flow("").theory: "float64", _VELOCITY.theory: "float64"}
        types |= {"estimate_valid": "boolean"}
    return types


def _row(point: Point, run: RunDirectory, sections: Sequence[str]) -> dict[str, Any]:
    """What is known of a point; ``exact`` holds columns that not every sweep has."""
    state = run.read_state()
    row = {"point": point.index, "run": point.run, "replicate": point.replicate}
    row |= {"seed": point.seed, "ranks": point.ranks, "exact": {}}
    row |= {"wall_s": state.get("wall_s"), **_how_it_went(state)}
    row |= {name: state.get(name, 0) for name in ("failures", "continuations")}
    try:
        results = json.loads(run.results.read_bytes())
    except FileNotFoundError:
        return row
    except ValueError as error:
        return row | {"state": "failed", "reason": f"results.json cannot be read ({error})"}
    try:
        answer = _answer(results, sections, run)
    except (LookupError, TypeError, AttributeError) as error:
        why = f"results.json is not whole ({type(error).__name__}: {error})"
        return row | {"state": "failed", "reason": why}
    return row | {"state": "done", "reason": None} | answer


def _how_it_went(state: Mapping[str, Any]) -> dict[str, Any]:
    name = state["state"]
    faults = state.get("faults") or [_REASONS.get(name)]
    reason = None if faults[0] is None else " ".join(str(faults[0]).split())
    return {"state": _STATES.get(name, name), "reason": reason}


def _answer(
    results: Mapping[str, Any], sections: Sequence[str], run: RunDirectory
) -> dict[str, Any]:
    cost, estimate, exact = results["cost"], results["estimate"], results["exact"]
    row = {
        "verdict": results["verdict"],
        "reasons": "; ".join(results["reasons"]) or None,
        "max_overlap_over_radius": results["max_overlap_over_radius"],
        "step_s": results["time_step_s"],
        "core_s": cost["wall_s"] * cost["ranks"],
        **{name: cost[name] for name in ("wall_s", "steps", "particle_steps_per_s")},
        _flow("").theory: estimate.get(_flow("").field),
        _VELOCITY.theory: estimate.get(_VELOCITY.field),
        "estimate_valid": estimate.get("valid"),
        "driver_version": results["provenance"]["liggghts_driver"],
        "engine_version": results["provenance"]["engine"],
        "exact": {check["name"]: check["simulated"] for check in exact}
        | {f"exact_{check['name']}": check["exact"] for check in exact},
    }
    compared = results["comparison"]
    for name in sections:
        found = results["sections"][name]["particle_flow_rate_m3_s"]
        row |= _measured(_flow(name), found, compared)
    if results["flowing_velocity_m_s"]:
        row |= _measured(_VELOCITY, results["flowing_velocity_m_s"], compared)
    if sections:
        last = _last_row(run.series)
        row |= {f"volume_end_{name}_m3": last.get(f"volume_{name}_m3") for name in sections}
    return row


def _measured(
    result: Result, found: Mapping[str, Any], comparison: Mapping[str, Any]
) -> dict[str, Any]:
    """A mean with its interval, and both over its estimate."""
    compared = comparison.get(result.name, {})
    ci95, estimated = found["ci95"], compared.get("estimated") or 0.0
    known = ci95 is not None and estimated != 0.0
    return {
        result.column: found["mean"],
        result.part("ci95"): ci95,
        f"{result.stem}_steady": found["steady"],
        f"ratio_{result.name}": compared.get("ratio"),
        f"ratio_{result.name}_ci95": ci95 / abs(estimated) if known else None,
        f"z_score_{result.name}": compared.get("z_score"),
    }


def _last_row(path: Path) -> dict[str, float]:
    """The last row of a series, without reading what is before it; nothing where it is gone."""
    if not path.exists():
        return {}
    with path.open("rb") as file:
        names = file.readline().decode().strip().split(",")
        file.seek(-min(_ROW_BYTES, path.stat().st_size), os.SEEK_END)
        values = file.read().decode().rstrip("\n").rpartition("\n")[2].split(",")
    return {name: float(value) for name, value in zip(names, values, strict=True) if value}
