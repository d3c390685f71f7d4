"""The time series that the engine wrote, with the columns that follow from it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from liggghts_driver.errors import ParseError
from liggghts_driver.physics.drag import reynolds
from liggghts_driver.prediction import pore_velocity_m_s

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from liggghts_driver.case import Case
    from liggghts_driver.rundir import RunDirectory


def read_run_series(run: RunDirectory) -> pd.DataFrame:
    """Rows of a run from its start on, those of its earlier segments first; as ``read_series``.

    Raises
    ------
    ParseError
        If a part has no series, or one that is not what it should be.
    """
    return read_parts(run.parts())


def read_parts(parts: Sequence[RunDirectory]) -> pd.DataFrame:
    """The same of some parts of a run, in the order of time."""
    return pd.concat([read_series(part.engine_series) for part in parts], ignore_index=True)


def read_series(path: Path) -> pd.DataFrame:
    """Rows of the file that the deck's ``fix print`` writes: a line of names, then numbers.

    A last line without its end was cut off while it was written and is left out.

    Raises
    ------
    ParseError
        If the file is absent or a complete row has not one number for each name.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ParseError(f"{path}: the engine wrote no series ({error.strerror})") from None
    except UnicodeDecodeError as error:
        raise ParseError(f"{path}: not a text ({error.reason} at byte {error.start})") from None
    complete = text[: text.rfind("\n") + 1].splitlines()
    if not complete:
        raise ParseError(f"{path}: empty; the engine wrote no series")
    names = complete[0].split()
    if names.count("step") != 1 or len(set(names)) != len(names):
        raise ParseError(f"{path}, line 1: expected names, each once and step among them")
    rows = [_numbers(line, names, f"{path}, line {n}") for n, line in enumerate(complete[1:], 2)]
    table = pd.DataFrame(np.array(rows).reshape(-1, len(names)), columns=names)
    return table.astype({"step": np.int64})


#: Columns that hold the largest of all particles, and what the engine has for the largest of none.
_LARGEST = frozenset({"largest_speed_m_s", "largest_reynolds_squared"})
_OF_NONE = -1e20


def read_row(line: str, names: list[str]) -> list[float]:
    """The numbers of a row; the largest of no particles, or of no numbers, is 0.

    Raises
    ------
    ValueError
        If it has not one number for each name; the message says what it has.
    """
    try:
        numbers = [float(word) for word in line.split()]
    except ValueError:
        raise ValueError(f"expected {len(names)} numbers, found {line[:80]!r}") from None
    if len(numbers) != len(names):
        raise ValueError(f"expected {len(names)} numbers, found {len(numbers)}")
    row = zip(names, numbers, strict=True)
    return [0.0 if name in _LARGEST and value == _OF_NONE else value for name, value in row]


def _numbers(line: str, names: list[str], where: str) -> list[float]:
    try:
        numbers = read_row(line, names)
    except ValueError as error:
        raise ParseError(f"{where}: {error}") from None
    step = numbers[names.index("step")]
    if not step.is_integer():
        raise ParseError(f"{where}: {step} is no step")
    return numbers


def fastest_piston_m_s(series: pd.DataFrame) -> float:
    """The piston's largest speed between two rows of a series; 0 without a piston."""
    if "piston_x_m" not in series:
        return 0.0
    speeds = np.diff(series["piston_x_m"]) / np.diff(series["time_s"])
    return float(np.abs(speeds).max())


def complete_series(raw: pd.DataFrame, case: Case) -> pd.DataFrame:
    """The series of a case in our columns, each with its unit.

    Adds the row of the start, which the engine does not print, and the columns ``time_s``,
    ``volume_<section>_m3`` (volume that has passed a section since the start),
    ``flowing_velocity_m_s`` (nan while nothing flows) and ``largest_reynolds``.
    """
    table = pd.concat([_start(raw, case), raw], ignore_index=True)
    table.insert(1, "time_s", table["step"] * case.time.step_s)
    for name in case.layout.sections:
        past = table.pop(f"volume_past_{name}_m3")
        table[f"volume_{name}_m3"] = past - past.iloc[0]
    if "flow_velocity_sum_m_s" in table:
        total = table.pop("flow_velocity_sum_m_s")
        table["flowing_velocity_m_s"] = (total / table["flowing"]).where(table["flowing"] > 0)
    if "largest_reynolds_squared" in table:
        table["largest_reynolds"] = np.sqrt(table.pop("largest_reynolds_squared"))
    return table


def _start(raw: pd.DataFrame, case: Case) -> pd.DataFrame:
    """The row of step 0, from the population itself."""
    population = case.population
    speeds = np.linalg.norm(population.velocities_m_s[: population.particles], axis=1)
    volumes = population.particle_volumes_m3
    x = population.centres_m[: population.particles, 0]
    row = dict.fromkeys(raw.columns, 0.0)
    row["largest_speed_m_s"] = float(speeds.max(initial=0.0))
    masses = case.scene.particles.density * volumes
    row["kinetic_energy_j"] = float((masses * speeds**2).sum() / 2)
    for name, place in case.layout.sections.items():
        row[f"volume_past_{name}_m3"] = float(volumes[x > place].sum())
    if "piston_x_m" in row:
        row["piston_x_m"] = case.layout.low[0]
    if "largest_reynolds_squared" in row:
        row["largest_reynolds_squared"] = _largest_reynolds(case) ** 2
    return pd.DataFrame([row]).astype({"step": np.int64})


def _largest_reynolds(case: Case) -> float:
    """The largest Reynolds number of the start, when the fluid moves only if it is constant."""
    fluid, population = case.scene.fluid, case.population
    assert fluid is not None
    slip = population.velocities_m_s[: population.particles].copy()
    before = population.centres_m[: population.particles, 0] < 0.0
    outside = before if case.scene.specimen is not None else np.ones_like(before)
    if fluid.velocity_outside == "constant":
        slip[outside, 0] -= fluid.velocity
    if fluid.velocity_inside == "pore":
        slip[~outside, 0] -= pore_velocity_m_s(case.scene)
    speeds = np.linalg.norm(slip, axis=1)
    found = reynolds(fluid.density, fluid.viscosity, population.particle_radii_m, speeds)
    return float(found.max(initial=0.0))
