"""The page of a sweep: counts, figures, combinations and points in one file."""

from __future__ import annotations

import os
import platform
import shlex
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import numpy as np
import pandas as pd

from liggghts_driver import __version__
from liggghts_driver.report.environment import page_environment
from liggghts_driver.report.numbers import NONE, Unit, number, unit_for, with_error
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.sweeps.figures import Scale
from liggghts_driver.sweeps.pooling import OUTCOMES
from liggghts_driver.sweeps.table import axis_column, axis_unit, results_in

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from liggghts_driver.report.picture import Picture
    from liggghts_driver.sweeps.table import Result

#: A longer table stands in the CSV alone: a browser would choke on it.
MOST_ROWS = 2000
#: Values whose largest is this many times the smallest may stand on a logarithmic scale: as an
#: axis, or as a result.
_WIDE_AXIS, _WIDE_RESULT = 8.0, 30.0
_PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"))
_SUPERSCRIPTS = str.maketrans("23", "²³")
_STATES = ("done", "running", "waiting", "interrupted", "failed")
_BAD = ("failed", "interrupted")


@dataclass(frozen=True)
class Heading:
    """What stands at the head of the page."""

    title: str
    source: str
    facts: Mapping[str, str]
    notes: Sequence[str]


def axis_scale(key: str, values: pd.Series[Any]) -> Scale:
    """The scale of an axis: logarithmic where its values are spaced so, words for what is none."""
    label, unit = " ".join(key.replace("_", " ").split(".")), axis_unit(key)
    if values.dtype.kind not in "if":
        label = f"{label} [{unit}]" if unit else label
        return Scale(label, Unit("", 1.0), tuple(dict.fromkeys(map(str, values))))
    distinct = np.unique(values.dropna().to_numpy(dtype=np.float64))
    log = _log_spaced(distinct)
    return Scale(label, shown_unit(unit, _typical(distinct, log=log)), log=log)


def result_scale(result: Result, values: np.ndarray[Any, Any], *, beside_log: bool) -> Scale:
    """The scale of a result; logarithmic only beside a logarithmic axis."""
    known = values[np.isfinite(values)]
    log = bool(beside_log and 0.0 < known.min() <= known.max() / _WIDE_RESULT)
    unit = shown_unit(result.unit, _typical(known, log=log))
    return Scale(result.title, unit, log=log)


def _typical(known: np.ndarray[Any, Any], *, log: bool) -> float:
    """The size for which a unit is chosen: the largest; on a logarithmic scale the middle."""
    largest = float(np.abs(known).max(initial=0.0))
    return float(known.min() * largest) ** 0.5 if log else largest


def shown_unit(unit: str, largest: float) -> Unit:
    """A unit in which to show values of a given SI unit: ``Pa/m`` and 2e4 make kPa/m."""
    name = unit.translate(_SUPERSCRIPTS).replace(" ", "·")
    if name in {"s", "m", "m/s", "m³/s", "m³", "N", "J"}:
        return unit_for(name, largest)
    if not name.startswith(("Pa", "J")) or largest == 0.0:
        return Unit(name, 1.0)
    size, prefix = next((p for p in _PREFIXES if largest >= p[0]), _PREFIXES[-1])
    return Unit(prefix + name, size)


def _log_spaced(distinct: np.ndarray[Any, Any]) -> bool:
    """Whether ratios of neighbours are more alike than their differences."""
    if distinct.size < 3 or distinct[0] <= 0.0 or distinct[-1] < _WIDE_AXIS * distinct[0]:
        return False
    ratios, steps = np.diff(np.log(distinct)), np.diff(distinct)
    return bool(ratios.std() / ratios.mean() < steps.std() / steps.mean())


def render_page(
    heading: Heading,
    points: pd.DataFrame,
    pooled: pd.DataFrame,
    axes: Sequence[str],
    pictures: Sequence[Picture],
    folder: Path,
    runs_folder: Path,
) -> str:
    """The HTML of a sweep.

    Parameters
    ----------
    heading
        Title, provenance, notes.
    points, pooled
        As ``points_table`` and ``pool`` make them.
    axes
        Keys of the axes.
    pictures
        Figures.
    folder
        Where the page will stand: links to the reports are relative to it.
    runs_folder
        Where the run directories are.
    """
    columns = [axis_column(key) for key in axes]
    scales = [axis_scale(key, points[column]) for key, column in zip(axes, columns, strict=True)]
    shown = points if len(points) <= MOST_ROWS else points[points["state"].isin(_BAD)]
    runs = os.path.relpath(runs_folder, folder)
    return (
        page_environment()
        .get_template("sweep.html.j2")
        .render(
            heading=heading,
            headline=_headline(points),
            pictures=pictures,
            scales=scales,
            columns=columns,
            results=_results(pooled),
            combinations=list(_combinations(pooled[:MOST_ROWS], scales, columns)),
            combinations_left=max(0, len(pooled) - MOST_ROWS),
            rows=list(_rows(shown[:MOST_ROWS], scales, columns, runs_folder, runs)),
            points=len(points),
            bad=int(points["state"].isin(_BAD).sum()),
            whole=len(points) <= MOST_ROWS,
            runs=runs,
        )
    )


def provenance(points: pd.DataFrame, command: Sequence[str]) -> dict[str, str]:
    """What made the page and the runs behind it."""

    def versions(name: str) -> str:
        return ", ".join(sorted(points[f"{name}_version"].dropna().unique())) or "none"

    core_s = points.drop_duplicates("run")["core_s"].sum()  # points may share a run
    return {
        "Collected": time.strftime("%Y-%m-%d %H:%M:%S %z"),
        "Command": shlex.join(command) or "from Python",
        "Collected by": f"liggghts-driver {__version__}, Python {platform.python_version()}, "
        f"pandas {pd.__version__}",
        "Runs by liggghts-driver": versions("driver"),
        "Engine": versions("engine"),
        "Core time": f"{core_s / 3600.0:.3g} h of finished runs",
    }


def _headline(points: pd.DataFrame) -> dict[str, Any]:
    """How far the sweep is, in words, with a mark that needs no colour to be told."""
    states, verdicts = points["state"].value_counts(), points["verdict"].value_counts()
    done, failed = int(states.get("done", 0)), int(states.get("failed", 0))
    counts = [f"{number(int(states[name]))} {name}" for name in _STATES[1:] if name in states]
    found = [f"{number(int(n))} {_spoken(str(name))}" for name, n in verdicts.items()]
    sound = failed == 0 and done == int(verdicts.get("valid", 0))
    kind = "invalid" if failed or "invalid" in verdicts else "valid" if sound else "not_steady"
    return {
        "kind": kind if done == len(points) or failed else "not_steady",
        "word": f"{number(done)} of {number(len(points))} points done",
        "lines": [line for line in (", ".join(found), ", ".join(counts)) if line],
    }


def _spoken(name: str) -> str:
    return name.replace("_", " ")


def _results(pooled: pd.DataFrame) -> list[dict[str, Any]]:
    """Each result with a column of the table of combinations, and its unit."""
    return [{"title": r.title, "unit": _unit(pooled, r).name} for r in results_in(pooled.columns)]


def _unit(pooled: pd.DataFrame, result: Result) -> Unit:
    values = pooled[[result.column, result.theory]].to_numpy(dtype=np.float64)
    return shown_unit(result.unit, float(np.abs(values[np.isfinite(values)]).max(initial=0.0)))


def _combinations(
    pooled: pd.DataFrame, scales: Sequence[Scale], columns: Sequence[str]
) -> Iterator[dict[str, Any]]:
    results = [(result, _unit(pooled, result)) for result in results_in(pooled.columns)]
    for row in pooled.to_dict("records"):
        counts = [f"{row[name]} {_spoken(name)}" for name in OUTCOMES if row[name]]
        yield {
            "places": [place_text(s, row[c]) for s, c in zip(scales, columns, strict=True)],
            "runs": counts,
            "results": [_measured(row, result, unit) for result, unit in results],
        }


def place_text(scale: Scale, value: Any) -> str:
    """A value of an axis as it was given, in the unit shown."""
    if scale.words:
        return str(value)
    text = f"{scale.unit.of(value):.6g}"
    return number(scale.unit.of(value)) if "e" in text else text.replace("-", "\u2212")


def _measured(row: Mapping[Any, Any], result: Result, unit: Unit) -> dict[str, Any]:
    """A mean with its interval and what it is made of, and the ratio to theory, as texts."""
    value, ci95, within, between = (
        None if pd.isna(row[name]) else float(row[name])
        for name in (
            result.column,
            result.part("ci95"),
            result.variance("within"),
            result.variance("between"),
        )
    )
    ratio = row[f"ratio_{result.name}"]
    error = row[f"ratio_{result.name}_ci95"]
    notes = ["not steady"] if row["mean_of"] == "not_steady" else []
    notes += ["one run"] if row[f"{result.stem}_interval_from"] == "one_run" else []
    if within is not None and between is not None:
        parts = [number(unit.of(part**0.5), 2) for part in (within, between)]
        notes += [f"within {parts[0]}", f"between {parts[1]}"]
    return {
        "value": value,
        "text": NONE if value is None else _with_error(unit.of(value), _scaled(ci95, unit)),
        "notes": notes if value is not None else [],
        "ratio": NONE if pd.isna(ratio) else _with_error(ratio, None if pd.isna(error) else error),
    }


def _with_error(value: float, error: float | None) -> str:
    return with_error(value, error) if error is None or np.isfinite(error) else number(value)


def _scaled(value: float | None, unit: Unit) -> float | None:
    return None if value is None else unit.of(value)


def _rows(
    points: pd.DataFrame,
    scales: Sequence[Scale],
    columns: Sequence[str],
    runs_folder: Path,
    runs: str,
) -> Iterator[dict[str, Any]]:
    for row in points.to_dict("records"):
        report = RunDirectory(runs_folder / row["run"]).report
        reason = row["reasons"] if row["state"] == "done" else row["reason"]
        yield {
            "point": row["point"],
            "run": row["run"],
            "link": quote(f"{runs}/{row['run']}/{report.name}") if report.exists() else None,
            "replicate": row["replicate"],
            "places": [place_text(s, row[c]) for s, c in zip(scales, columns, strict=True)],
            "state": row["state"],
            "verdict": "" if pd.isna(row["verdict"]) else _spoken(row["verdict"]),
            "reason": "" if pd.isna(reason) else reason,
        }
