"""How results are drawn against the axes of a sweep: points with intervals, maps, main effects."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.colors import LogNorm, Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import FixedLocator, NullLocator

from liggghts_driver.report.numbers import Unit, number
from liggghts_driver.report.style import (
    BLUE,
    DASHED,
    GREY,
    INK,
    SHADE,
    VERMILION,
    log_ticks,
    tick_at,
    tick_log,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    import pandas as pd
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]
    Look = dict[str, Any]

#: Where nothing usable came out, in words, and how a map hatches it.
LACKING = {
    "failed": ("failed", "xxxx"),
    "invalid": ("invalid", "////"),
    "unfinished": ("not finished", "...."),
    "nothing": ("no value", ""),
}
#: Over the width: distance of neighbouring series where they are few, and of runs from their mean.
_ASIDE, _FEW, _DOTS_ASIDE = 0.012, 3, 0.016
#: Theory inside its validity and outside: between words there is nothing.
_CURVE: tuple[Look, ...] = (
    {"linestyle": DASHED, "linewidth": 1.6},
    {"linestyle": ":", "linewidth": 1.4},
)
_CURVE_AT_WORDS: tuple[Look, ...] = tuple(
    {"linestyle": "none", "marker": "_", "markersize": 36, "markeredgewidth": width}
    for width in (2.0, 0.8)
)


@dataclass(frozen=True)
class Scale:
    """How values stand along one direction: label, unit; words at 0, 1, 2 ...; or logarithms."""

    label: str
    unit: Unit
    words: tuple[str, ...] = ()
    log: bool = False

    @property
    def text(self) -> str:
        """The label with its unit."""
        return f"{self.label} [{self.unit.name}]" if self.unit.name else self.label

    def place(self, values: pd.Series[Any]) -> FloatArray:
        """Where values stand, in the unit shown."""
        if self.words:
            return np.array([self.words.index(str(value)) for value in values], dtype=np.float64)
        return values.to_numpy(dtype=np.float64, na_value=np.nan) / self.unit.size

    def around(self, low: float, high: float) -> tuple[float, float]:
        """Limits that leave some room on both sides."""
        if self.words:
            return low - 0.5, high + 0.5
        if self.log:
            ratio = (high / low) ** 0.06 if high > low else 1.5
            return low / ratio, high * ratio
        room = 0.06 * (high - low) or 0.1 * abs(low) or 1.0
        return low - room, high + room

    def aside(self, places: FloatArray, share: float, low: float, high: float) -> FloatArray:
        """Places moved by a share of the way from ``low`` to ``high``."""
        return places * (high / low) ** share if self.log else places + share * (high - low)

    def dress(self, axes: Axes, which: Literal["x", "y"], low: float, high: float) -> None:
        """Label, limits and ticks of an axis."""
        axes.set(**{f"{which}label": self.text, f"{which}scale": "log" if self.log else "linear"})
        axes.set(**{f"{which}lim": (low, high)})
        axis = axes.xaxis if which == "x" else axes.yaxis
        if self.words:
            short = [word if len(word) <= 14 else f"{word[:13]}…" for word in self.words]
            tick_at(axis, range(len(short)), short)
        elif self.log:
            tick_log(axis, low, high)


@dataclass(frozen=True)
class Curve:
    """What theory says along x; ``valid`` where the case is inside its validity."""

    label: str
    colour: str
    x: FloatArray
    y: FloatArray
    valid: NDArray[np.bool_]


@dataclass(frozen=True)
class Series:
    """One result along x, in the units shown: means (nan: no usable run) with half intervals.

    ``steady`` tells whether the runs of each mean were; ``dots`` are x and y of the single runs.
    """

    label: str
    colour: str
    marker: str
    x: FloatArray
    y: FloatArray
    error: FloatArray
    steady: NDArray[np.bool_]
    dots: tuple[FloatArray, FloatArray]


def paint_series(
    x: Scale, y: Scale, series: Sequence[Series], curves: Sequence[Curve], figure: Figure
) -> None:
    """Results against one axis, with their intervals, their runs, and theory."""
    axes = figure.add_subplot()
    places = np.concatenate([one.x for one in series])
    width = x.around(float(places.min()), float(places.max()))
    looks = _CURVE_AT_WORDS if x.words else _CURVE
    for curve in curves:
        for look, where in zip(looks, (curve.valid, ~curve.valid), strict=True):
            axes.plot(curve.x, np.where(where, curve.y, np.nan), color=curve.colour, **look)
    apart = _ASIDE if len(series) <= _FEW else 0.0
    for turn, one in enumerate(series):
        share = (turn - (len(series) - 1) / 2) * apart
        outside = share + (_DOTS_ASIDE if share >= 0.0 else -_DOTS_ASIDE)
        _series(axes, one, x.aside(one.x, share, *width), x.aside(one.dots[0], outside, *width))
    x.dress(axes, "x", *width)
    y.dress(axes, "y", *y.around(*_heights(y, series, curves)))
    _legend(figure, [*_handles(series), *_curve_handles(curves, looks)])


def _series(axes: Axes, one: Series, places: FloatArray, dots: FloatArray) -> None:
    common: Any = {"color": one.colour, "markersize": 5.5}
    axes.plot(dots, one.dots[1], ".", color=one.colour, alpha=0.5, markersize=5)
    bars: Any = {"yerr": one.error, "fmt": one.marker, "capsize": 2.5, "linewidth": 1.2}
    axes.errorbar(places, one.y, **bars, **common)
    hollow, lacking = ~one.steady, np.isnan(one.y)
    face: Any = {"markerfacecolor": "white", "zorder": 3}  # over the bars
    axes.plot(places[hollow], one.y[hollow], one.marker, **face, **common)
    bottom = np.full(int(lacking.sum()), 0.03)
    axes.plot(places[lacking], bottom, "x", transform=axes.get_xaxis_transform(), **common)


def _heights(y: Scale, series: Sequence[Series], curves: Sequence[Curve]) -> tuple[float, float]:
    """What the y axis shows: all values; of an interval at most their range beyond them."""
    heights = [*(one.y for one in series), *(one.dots[1] for one in series)]
    values = _finite(*heights, *(curve.y for curve in curves))
    bars = [one.y + sign * np.nan_to_num(one.error) for one in series for sign in (-1, 1)]
    ends, low, high = _finite(values, *bars), float(values.min()), float(values.max())
    span = high - low or np.inf
    reach = (low / 3.0, high * 3.0) if y.log else (low - span, high + span)
    return max(float(ends.min()), reach[0]), min(float(ends.max()), reach[1])


def _finite(*arrays: FloatArray) -> FloatArray:
    together = np.concatenate(arrays)
    return together[np.isfinite(together)]


def _line(label: str, colour: str, **look: Any) -> Line2D:
    return Line2D([], [], color=colour, label=label, **{"linestyle": "none", **look})


def _handles(series: Sequence[Series]) -> Iterator[Artist]:
    for one in series:
        yield _line(one.label, one.colour, marker=one.marker)
    if any(one.dots[0].size for one in series):
        yield _line("single runs", GREY, marker=".")
    if any(np.isfinite(one.y[~one.steady]).any() for one in series):
        yield _line("not steady", GREY, marker="o", markerfacecolor="white")
    if any(np.isnan(one.y).any() for one in series):
        yield _line("no usable run", GREY, marker="x")


def _curve_handles(curves: Sequence[Curve], looks: Sequence[Look]) -> Iterator[Artist]:
    for look, words, valid in zip(looks, ("", ", not valid"), (True, False), strict=True):
        if any((curve.valid[np.isfinite(curve.y)] == valid).any() for curve in curves):
            short = {"markersize": 12} if "marker" in look else {}
            yield _line(curves[0].label + words, INK, **{**look, **short})


def _legend(figure: Figure, handles: Sequence[Artist]) -> None:
    if handles:
        figure.legend(handles=handles, loc="outside upper left", ncols=2)


def paint_map(x: Scale, y: Scale, colour: Scale, cells: pd.DataFrame, figure: Figure) -> None:
    """A result over two axes.

    Parameters
    ----------
    x, y, colour
        Scales of the axes and of the result.
    cells
        ``x``, ``y``, ``value`` (in the units shown, nan for none) and ``state`` (``valid``,
        ``not_steady``, or one of ``LACKING``); a row for each combination of a grid.
    """
    axes = figure.add_subplot()
    axes.grid(visible=False)
    known = cells[cells["value"].notna()]
    low, high = known["value"].min(), known["value"].max()
    ends = (low, high) if low < high else colour.around(low, high)
    norm = (LogNorm if colour.log else Normalize)(*ends)
    sides = [_edges(x, cells["x"].to_numpy()), _edges(y, cells["y"].to_numpy())]
    grid = cells.set_index(["y", "x"])["value"].unstack()  # noqa: PD010 - one value each
    mesh = axes.pcolormesh(*sides, grid.to_numpy(), norm=norm, cmap="viridis")
    unsteady = cells[cells["state"] == "not_steady"]
    size = float(np.clip(80 / max(side.size for side in sides), 0.3, 4.0))  # in many small cells
    ring: Any = {"marker": "o", "markerfacecolor": "white", "markersize": size}
    axes.plot(unsteady["x"], unsteady["y"], color=INK, linestyle="none", **ring)
    handles: list[Artist] = (
        [_line("not steady", INK, **{**ring, "markersize": 4})] if len(unsteady) else []
    )
    for name, (label, hatch) in LACKING.items():
        lacking = cells.loc[cells["state"] == name, ["x", "y"]].to_numpy()
        look: Any = {"facecolor": SHADE, "edgecolor": GREY, "hatch": hatch, "linewidth": 0.0}
        patches = [Rectangle(*_cell(sides, place), **look) for place in lacking]
        for patch in patches:
            axes.add_patch(patch)
        handles += [Patch(label=label, **look)] if patches else []
    x.dress(axes, "x", sides[0][0], sides[0][-1])
    y.dress(axes, "y", sides[1][0], sides[1][-1])
    _colour_bar(figure, axes, mesh, colour)
    _legend(figure, handles)


def _edges(scale: Scale, places: FloatArray) -> FloatArray:
    """Sides of the cells around distinct places, half way between them as the scale has it."""
    distinct = np.unique(places)
    if distinct.size == 1:
        return np.array(scale.around(distinct[0], distinct[0]))
    along = np.log(distinct) if scale.log else distinct
    inner = (along[1:] + along[:-1]) / 2
    edges = np.r_[2 * along[0] - inner[0], inner, 2 * along[-1] - inner[-1]]
    return np.asarray(np.exp(edges) if scale.log else edges)


def _cell(
    sides: Sequence[FloatArray], place: FloatArray
) -> tuple[tuple[float, float], float, float]:
    """Corner, width and height of the cell around a place."""
    column, row = (np.searchsorted(s, at) for s, at in zip(sides, place, strict=True))
    (left, right), (low, high) = sides[0][column - 1 : column + 1], sides[1][row - 1 : row + 1]
    return (left, low), right - left, high - low


def _colour_bar(figure: Figure, axes: Axes, mesh: Any, colour: Scale) -> None:
    bar = figure.colorbar(mesh, ax=axes, label=colour.text)
    bar.ax.xaxis.set_major_locator(FixedLocator([]))
    if colour.log:
        ticks = log_ticks(mesh.norm.vmin, mesh.norm.vmax)
        bar.set_ticks(ticks, labels=[number(tick, 1) for tick in ticks])
        bar.ax.yaxis.set_minor_locator(NullLocator())


@dataclass(frozen=True)
class Panel:
    """A result against one of many axes: each combination, and the mean over the others."""

    x: Scale
    places: FloatArray
    heights: FloatArray
    mean: tuple[FloatArray, FloatArray]


def paint_effects(y: Scale, panels: Sequence[Panel], figure: Figure) -> None:
    """A panel for each axis, one below the other in two columns."""
    grid = figure.subplots(-(-len(panels) // 2), 2, sharey=True, squeeze=False)
    values = _finite(*(panel.heights for panel in panels))
    for axes in grid.flat[len(panels) :]:
        axes.remove()
    for axes, panel in zip(grid.flat, panels, strict=False):
        axes.plot(panel.places, panel.heights, "o", color=BLUE, alpha=0.35, markersize=4)
        joined = "none" if panel.x.words else "-"
        axes.plot(*panel.mean, color=VERMILION, marker="s", markersize=5, linestyle=joined)
        panel.x.dress(axes, "x", *panel.x.around(panel.places.min(), panel.places.max()))
        y.dress(axes, "y", *y.around(float(values.min()), float(values.max())))
        axes.set_ylabel("")
    figure.supylabel(y.text, fontsize="medium")
    handles = [_line("a combination", BLUE, marker="o", alpha=0.5)]
    if any(panel.mean[0].size for panel in panels):
        handles.append(_line("mean over the others", VERMILION, marker="s", linestyle="-"))
    _legend(figure, handles)
