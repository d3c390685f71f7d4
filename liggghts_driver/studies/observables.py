"""What a study compares: a few numbers of a finished run, each with its unit in its name."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.results.plain import number_or_nan
from liggghts_driver.results.positions import iter_instants

if TYPE_CHECKING:
    from collections.abc import Iterator

    import pandas as pd

    from liggghts_driver.scene.model import Scene
    from liggghts_driver.solve import Solution

#: For people, by the beginning of a name; a section follows where the name goes on with one.
_TITLES = {
    "volume_": "volume past the {}",
    "flow_rate_": "flow rate, {}",
    "flowing_velocity_": "velocity of what flows",
    "distance_x_": "distance along x",
    "distance_": "distance travelled",
    "rms_speed_": "r.m.s. speed",
    "largest_overlap_": "largest overlap",
}
_UNITS = {
    "volume_": "m3",
    "flow_rate_": "m3/s",
    "flowing_velocity_": "m/s",
    "distance_": "m",
    "rms_speed_": "m/s",
    "largest_overlap_": "radii",
}
_ENDS = ("_m3_s", "_m3", "_m_s", "_m", "_over_radius")


def observe(solution: Solution) -> dict[str, float]:
    """The observables of a finished run; what a run does not have (nothing flows) is left out.

    ``volume_<section>_m3`` at the end; ``flow_rate_<section>_m3_s``, ``flowing_velocity_m_s`` and
    ``rms_speed_m_s`` over the second half of the run; ``distance_m`` and ``distance_x_m``, the mean
    over the particles of how far they are at the end from where they were, and of its x component;
    ``largest_overlap_over_radius`` in any frame.

    Raises
    ------
    ParseError
        If the frames are not what they should be.
    """
    return {name: float(value) for name, value in _all(solution) if np.isfinite(value)}


def main_observable(scene: Scene) -> str:
    """The one that answers the scene's question: what went in, or how far the particles went."""
    return "distance_m" if scene.specimen is None else "volume_entrance_m3"


def title_of(name: str) -> str:
    """An observable's name for people."""
    start = next(start for start in _TITLES if name.startswith(start))
    end = next(end for end in _ENDS if name.endswith(end))
    return _TITLES[start].format(name.removeprefix(start).removesuffix(end))


def unit_of(name: str) -> str:
    """An observable's unit."""
    return next(unit for start, unit in _UNITS.items() if name.startswith(start))


def _all(solution: Solution) -> Iterator[tuple[str, float]]:
    series = solution.series
    late = series[series["time_s"] >= series["time_s"].iloc[-1] / 2.0]
    for name in solution.case.layout.sections:
        yield f"volume_{name}_m3", series[f"volume_{name}_m3"].iloc[-1]
        yield f"flow_rate_{name}_m3_s", _late_rate(series, f"volume_{name}_m3")
    if "flowing_velocity_m_s" in series:
        yield "flowing_velocity_m_s", late["flowing_velocity_m_s"].mean()  # nan: nothing flows
    if solution.case.population.particles:
        yield from _distances(solution)
        yield "rms_speed_m_s", np.sqrt(2.0 * late["kinetic_energy_j"] / _mass_kg(solution)).mean()
        deepest = solution.results["max_overlap_over_radius"]
        yield "largest_overlap_over_radius", number_or_nan(deepest)


def _late_rate(series: pd.DataFrame, column: str) -> float:
    """Mean rate over the second half: what comes from half the time on, over that half."""
    time, volume = series["time_s"].to_numpy(), series[column].to_numpy()
    half = time[-1] / 2.0
    return float((volume[-1] - np.interp(half, time, volume)) / half)


def _mass_kg(solution: Solution) -> float:
    case = solution.case
    return float(case.scene.particles.density * case.population.particle_volumes_m3.sum())


def _distances(solution: Solution) -> Iterator[tuple[str, float]]:
    instants = iter_instants(solution.directory)
    first = last = next(instants).positions_m
    for instant in instants:
        last = instant.positions_m
    path = last - first
    yield "distance_m", np.linalg.norm(path, axis=1).mean()
    yield "distance_x_m", path[:, 0].mean()
