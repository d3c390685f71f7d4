"""Fig. 3 remade: the spheres at some instants, from the frames of a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from matplotlib.collections import EllipseCollection
from matplotlib.colors import Normalize, to_rgba

from liggghts_driver.deck.build import FRAME_COLUMNS
from liggghts_driver.prepare import prepare
from liggghts_driver.report.style import INK, VERMILION
from liggghts_driver.results.binarydump import iter_binary_frames

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from liggghts_driver.case import Case
    from liggghts_driver.rundir import RunDirectory

    FloatArray = NDArray[np.float64]

#: Instants that show the start, the collision with the grains, the pile-up and the steady flow [s].
INSTANTS_S = (0.0, 5.0, 8.0, 12.0, 25.0, 50.0)
_GRAIN = "#CDBDA3"
#: Velocities along the flow are shaded up to this [m/s]: free flight at 10 Pa/m, twice.
_FASTEST_M_S = 5.5e-3


@dataclass(frozen=True)
class View:
    """What is seen along y at an instant: the half behind the middle, the farthest first.

    ``x_m, z_m, radius_m`` are ``(n,)``; ``velocity_m_s`` is along x, nan for grains.
    """

    time_s: float
    x_m: FloatArray
    z_m: FloatArray
    radius_m: FloatArray
    velocity_m_s: FloatArray
    piston_x_m: float


def views(run: RunDirectory, instants_s: Sequence[float] = INSTANTS_S) -> tuple[View, ...]:
    """The frames of a run nearest to some instants.

    Raises
    ------
    ParseError
        If a frame is not what it should be.
    """
    case = prepare(run.read_scene())
    files = {run.step_of(path): path for path in run.frame_files()}
    series = pd.read_csv(run.series)
    found = []
    for instant in instants_s:
        step = min(files, key=lambda each: abs(each * case.time.step_s - instant))
        piston = float(np.interp(step, series["step"], series["piston_x_m"]))
        found.append(_view(case, files[step], step, piston))
    return tuple(found)


def _view(case: Case, path: Path, step: int, piston_x_m: float) -> View:
    frame = iter_binary_frames(path, FRAME_COLUMNS).first().sorted_by_id().data
    population = case.population
    grains = population.centres_m[population.particles :]
    particles = frame[["x", "y", "z"]].to_numpy()
    places = np.vstack([particles, grains])
    speeds = np.concatenate([frame["vx"].to_numpy(), np.full(len(grains), np.nan)])
    middle = 0.5 * (case.layout.low[1] + case.layout.high[1])
    behind = np.flatnonzero(places[:, 1] >= middle)
    order = behind[np.argsort(-places[behind, 1])]
    return View(
        step * case.time.step_s,
        places[order, 0],
        places[order, 2],
        population.radii_m[order],
        speeds[order],
        piston_x_m,
    )


def paint_snapshots(
    seen: Sequence[View], low: Sequence[float], high: Sequence[float], figure: Figure
) -> None:
    """Views below one another, two in a row; ``low`` and ``high`` are corners of the domain [m]."""
    grid = figure.subplots(-(-len(seen) // 2), 2, sharex=True, sharey=True, squeeze=False)
    shades = Normalize(0.0, 1e3 * _FASTEST_M_S)
    mapped = None
    for axes, view in zip(grid.flat, seen, strict=True):
        mapped = _paint(axes, view, shades)
        axes.set(xlim=(1e3 * low[0] - 3.0, 1e3 * high[0] + 3.0), aspect="equal")
        axes.set_ylim(1e3 * low[2] - 3.0, 1e3 * high[2] + 3.0)
        axes.set_title(f"t = {view.time_s:.0f} s", fontsize="small", loc="left")
        axes.grid(visible=False)
        axes.tick_params(labelsize="small")
    for axes in grid[-1]:
        axes.set_xlabel("x [mm]")
    for axes in grid[:, 0]:
        axes.set_ylabel("z [mm]")
    assert mapped is not None
    bar = figure.colorbar(mapped, ax=grid, location="bottom", shrink=0.6, aspect=40, extend="both")
    bar.set_label("velocity along x [mm/s]")


def _paint(axes: Axes, view: View, shades: Normalize) -> EllipseCollection:
    """Spheres, far ones first, in one collection so that the near hide the far."""
    sizes, places = 2e3 * view.radius_m, 1e3 * np.column_stack([view.x_m, view.z_m])
    shaded = EllipseCollection(
        sizes, sizes, 0.0, units="xy", offsets=places, transOffset=axes.transData, linewidths=0.15
    )
    shaded.set(edgecolor=INK, cmap="viridis", norm=shades)
    colours = shaded.to_rgba(1e3 * np.nan_to_num(view.velocity_m_s))
    grains = np.isnan(view.velocity_m_s)
    colours[grains] = to_rgba(_GRAIN)
    shaded.set_facecolor([tuple(colour) for colour in colours.tolist()])
    axes.add_collection(shaded)
    axes.axvline(0.0, color=INK, linewidth=0.6)
    axes.axvline(1e3 * view.piston_x_m, color=VERMILION, linewidth=1.6)
    return shaded
