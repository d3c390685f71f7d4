"""Gather a sweep: tables of its points and combinations, figures, and the page."""

from __future__ import annotations

import importlib.util
import math
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.colors import to_hex

from liggghts_driver.errors import DriverError
from liggghts_driver.outputs import write_bytes, write_text
from liggghts_driver.report.picture import Picture
from liggghts_driver.report.style import BLUE, GREEN, INK, ORANGE, PURPLE, SKY, VERMILION, draw
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.sweeps import figures, page, pooling
from liggghts_driver.sweeps.figures import Curve, Series
from liggghts_driver.sweeps.table import axis_column, points_table, results_in

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

    from liggghts_driver.sweeps.figures import Scale
    from liggghts_driver.sweeps.plan import Plan
    from liggghts_driver.sweeps.pooling import Theory
    from liggghts_driver.sweeps.table import Result

_HEIGHT_IN, _ROW_IN, _TOP_IN, _LEGEND_IN = 4.2, 2.6, 0.6, 0.22
_COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, INK)
_MARKERS = ("o", "s", "^", "D", "v", "P", "X")
#: Values of theory along an axis; lines in one figure; the share of a grid that makes it one.
_ALONG, _MOST_LINES, _GRID = 81, len(_MARKERS), 0.5


@dataclass(frozen=True)
class Collected:
    """What a sweep gave: its tables, the page, all files, and what is missing, a sentence each."""

    points: pd.DataFrame
    pooled: pd.DataFrame
    page: Path
    files: tuple[Path, ...]
    notes: tuple[str, ...]

    @property
    def verdicts(self) -> dict[str, int]:
        """How many points have which verdict; those without a result have none."""
        counted = self.points["verdict"].value_counts()
        return {str(name): int(count) for name, count in counted.items()}


def collect(
    plan: Plan,
    folder: Path,
    runs_folder: Path,
    command: Sequence[str] = (),
    write_report_of: Callable[[Path], object] = lambda _run: None,
) -> Collected:
    """Gather what a sweep gave so far; points that failed or did not run are rows as well.

    Parameters
    ----------
    plan
        The sweep.
    folder
        Where ``results.csv``, ``pooled.csv``, both as Parquet, ``figures`` and ``sweep.html`` go.
    runs_folder
        Where the run directories are.
    command
        The command line, for the record.
    write_report_of
        Writes the report of a finished run that has none, given its directory.
    """
    points = points_table(plan, runs_folder)
    notes = _write_reports(points, runs_folder, write_report_of)
    pooled = pooling.pool(points, plan.axes)
    pictures = draw_figures(points, pooled, plan.axes, pooling.theory_of(plan))
    files = []
    for name, table in (("results", points), ("pooled", pooled)):
        files.append(folder / f"{name}.csv")
        write_text(files[-1], table.to_csv(index=False))
        if importlib.util.find_spec("pyarrow") is not None:
            files.append(folder / f"{name}.parquet")
            write_bytes(files[-1], table.to_parquet(None, engine="pyarrow", index=False))
    if importlib.util.find_spec("pyarrow") is None:
        notes.append("no Parquet files: pyarrow is not installed; pip install pyarrow")
    for picture in pictures:
        files.append(folder / "figures" / f"{picture.name}.png")
        write_bytes(files[-1], picture.png)
    path = folder / "sweep.html"
    heading = page.Heading(plan.title, plan.source, page.provenance(points, command), notes)
    html = page.render_page(heading, points, pooled, plan.axes, pictures, folder, runs_folder)
    write_text(path, html)
    return Collected(points, pooled, path, (*files, path), tuple(notes))


def _write_reports(
    points: pd.DataFrame, runs_folder: Path, write_report_of: Callable[[Path], object]
) -> list[str]:
    """Write the reports that finished runs lack; a sentence for each that could not be."""
    notes = []
    for name in points.loc[points["state"] == "done", "run"].unique():
        run = RunDirectory(runs_folder / name)
        if run.report.exists():
            continue
        try:
            write_report_of(run.path)
        except DriverError as error:
            notes.append(f"run {name} has no report: {error}")
    return notes


def draw_figures(
    points: pd.DataFrame, pooled: pd.DataFrame, axes: Sequence[str], theory: Theory
) -> tuple[Picture, ...]:
    """The figures that a sweep calls for, by the number of its axes; none without a result."""
    drawing = _Drawing(points, pooled, tuple(axes), theory)
    found = [r for r in results_in(points.columns) if pooled[r.column].notna().any()]
    return tuple(drawing.pictures(found))


@dataclass(frozen=True)
class _Drawing:
    """What figures are drawn from, and which."""

    points: pd.DataFrame
    pooled: pd.DataFrame
    axes: tuple[str, ...]
    theory: Theory

    def pictures(self, results: Sequence[Result]) -> Iterator[Picture]:
        """Results against one axis; or each over two; or each against many in turn."""
        free = pooling.free_axes(self.pooled, self.axes)
        grid = math.prod(self.pooled[axis_column(key)].nunique() for key in free)
        if len(free) == 1:
            flows = [result for result in results if result.name != result.stem]
            for some in filter(None, [flows, *([r] for r in results if r not in flows)]):
                yield self._one_axis(some, free[0])
        elif len(free) == 2 and len(self.pooled) > _GRID * grid:
            for result in results:
                yield self._map(result, free)
                yield self._lines(result, *pooling.most_values_first(self.pooled, free))
        elif free:
            yield from (self._effects(result, free) for result in results)

    def _height(self, results: Sequence[Result], *, beside_log: bool) -> Scale:
        names = [name for result in results for name in (result.column, result.theory)]
        values = self.pooled[names].to_numpy(dtype=np.float64).ravel()
        scale = page.result_scale(results[0], values, beside_log=beside_log)
        return scale if len(results) == 1 else replace(scale, label="particle flow rate")

    def _one_axis(self, results: Sequence[Result], key: str) -> Picture:
        """Results against the only axis that varies."""
        x = page.axis_scale(key, self.pooled[axis_column(key)])
        y = self._height(results, beside_log=x.log)
        looks = [(r.title, _COLOURS[n], _MARKERS[n]) for n, r in enumerate(results)]
        runs, column = pooling.single_runs(self.points, self.pooled), axis_column(key)
        series = [
            _series(result, x, y, self.pooled, runs, column, look)
            for result, look in zip(results, looks, strict=True)
        ]
        curve = self._curve(results[0], x, y, key, {}, self.pooled, INK)
        name = results[0].stem if len(results) == 1 else "flow_rate"
        return _against(name, x, y, series, [curve] if curve else [])

    def _lines(self, result: Result, key: str, second: str) -> Picture:
        """A result against one of two axes, a line for each value of the other."""
        column, other = axis_column(key), axis_column(second)
        x, beside = (page.axis_scale(k, self.pooled[axis_column(k)]) for k in (key, second))
        y = self._height([result], beside_log=x.log or beside.log)
        values = list(self.pooled[other].drop_duplicates())
        values = values if beside.words else sorted(values)
        chosen = np.unique(np.linspace(0, len(values) - 1, min(len(values), _MOST_LINES)).round())
        runs, series, curves = pooling.single_runs(self.points, self.pooled), [], []
        for turn, value in enumerate(values[int(n)] for n in chosen):
            rows, dots = (t[t[other] == value] for t in (self.pooled, runs))
            shade = 0.85 * turn / max(1, len(chosen) - 1)
            colour = _COLOURS[turn] if beside.words else to_hex(mpl.colormaps["viridis"](shade))
            label = f"{beside.label} {page.place_text(beside, value)} {beside.unit.name}".rstrip()
            series.append(
                _series(result, x, y, rows, dots, column, (label, colour, _MARKERS[turn]))
            )
            curve = self._curve(result, x, y, key, {second: value}, rows, colour)
            curves += [curve] if curve else []
        left = f" {len(values) - len(chosen)} more values are not drawn." * (
            len(chosen) < len(values)
        )
        return _against(f"{result.stem}_lines", x, y, series, curves, left)

    def _map(self, result: Result, keys: Sequence[str]) -> Picture:
        """A result over two axes."""
        x, y = (page.axis_scale(key, self.pooled[axis_column(key)]) for key in keys)
        colour = self._height([result], beside_log=True)
        cells = pd.DataFrame(
            {
                "x": x.place(self.pooled[axis_column(keys[0])]),
                "y": y.place(self.pooled[axis_column(keys[1])]),
                "value": colour.place(self.pooled[result.column]),
                "state": pooling.state_of(self.pooled, result.column),
            }
        )
        paint = partial(figures.paint_map, x, y, colour, cells)
        text = f"{result.title} over {x.label} and {y.label}"
        caption = f"Mean {text}. Hatched: no usable run."
        return Picture(f"{result.stem}_map", draw(paint, _HEIGHT_IN), text, caption)

    def _effects(self, result: Result, keys: Sequence[str]) -> Picture:
        """A result against each of many axes."""
        columns = [axis_column(key) for key in keys]
        scales = [page.axis_scale(key, self.pooled[axis_column(key)]) for key in keys]
        y = self._height([result], beside_log=any(scale.log for scale in scales))
        known = self.pooled[self.pooled[result.column].notna()]
        panels = []
        for x, column in zip(scales, columns, strict=True):
            mean = pooling.main_effect(
                self.pooled, result.column, column, [c for c in columns if c != column]
            )
            line = x.place(mean.index.to_series()), y.place(mean)
            panels.append(
                figures.Panel(x, x.place(known[column]), y.place(known[result.column]), line)
            )
        height = _TOP_IN + _ROW_IN * -(-len(keys) // 2)
        text = f"{result.title} against each axis"
        caption = (
            f"{text.capitalize()}, at every combination. The line is the mean over those "
            "combinations of the other axes that are known at every value."
        )
        picture = draw(partial(figures.paint_effects, y, panels), height)
        return Picture(f"{result.stem}_effects", picture, text, caption)

    def _curve(
        self,
        result: Result,
        x: Scale,
        y: Scale,
        key: str,
        fixed: Mapping[str, Any],
        rows: pd.DataFrame,
        colour: str,
    ) -> Curve | None:
        """Theory along an axis: on a fine grid, or at the combinations alone."""
        column = axis_column(key)
        if result.field and len(pooling.varying_axes(self.pooled, self.axes)) == len(fixed) + 1:
            values = self._along(key, x, fixed)
            found = [self.theory({**fixed, key: value}) for value in values]
            heights = [np.nan if e is None else float(getattr(e, result.field)) for e in found]
            valid = np.array([e is not None and bool(e.valid) for e in found])
            at, height = x.place(pd.Series(values)), np.array(heights) / y.unit.size
        else:  # the others change with it, or there is no law between the points
            rows = rows.sort_values(column, key=lambda c: pd.Series(x.place(c), index=c.index))
            at, height = x.place(rows[column]), y.place(rows[result.theory])
            judged = (
                rows["estimate_valid"] if result.field else pd.Series(data=True, index=rows.index)
            )
            valid = judged.fillna(value=False).to_numpy(dtype=bool)
        label = "Darcy estimate" if result.field else "exact answer"
        return Curve(label, colour, at, height, valid) if np.isfinite(height).any() else None

    def _along(self, key: str, x: Scale, fixed: Mapping[str, Any]) -> list[Any]:
        """Values along an axis, close to each other where they are numbers."""
        values = self.pooled[axis_column(key)].drop_duplicates().tolist()
        if x.words:
            return values
        space = np.geomspace if x.log else np.linspace
        fine = space(min(values), max(values), _ALONG)
        if self.theory({**fixed, key: float(values[0])}) is None:  # a key of whole numbers
            return [int(value) for value in np.unique(fine.round())]
        return [float(value) for value in fine]


def _series(
    result: Result,
    x: Scale,
    y: Scale,
    table: pd.DataFrame,
    dots: pd.DataFrame,
    column: str,
    look: tuple[str, str, str],
) -> Series:
    """A result of some rows; ``look`` is its label, colour and marker."""
    error = y.place(table[result.part("ci95")]) if result.part("ci95") in table else None
    values = y.place(table[result.column])
    return Series(
        *look,
        x=x.place(table[column]),
        y=values,
        error=np.full_like(values, np.nan) if error is None else error,
        steady=(table["mean_of"] != "not_steady").to_numpy(dtype=bool),
        dots=(x.place(dots[column]), y.place(dots[result.column])),
    )


def _against(
    name: str, x: Scale, y: Scale, series: Sequence[Series], curves: Sequence[Curve], more: str = ""
) -> Picture:
    text = f"{y.label} against {x.label}"
    caption = f"{text.capitalize()}, with 95 % intervals; one that reaches the frame goes on."
    rows = (len(series) + 5) // 2  # of the legend
    height = _HEIGHT_IN + _LEGEND_IN * max(0, rows - 3)
    picture = draw(partial(figures.paint_series, x, y, series, curves), height)
    return Picture(name, picture, text, caption + more)
