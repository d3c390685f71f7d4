"""What the frames on disk say: volumes past the sections, and the largest overlap."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from liggghts_driver.contacts import contacts_at, largest_over_radius
from liggghts_driver.deck.build import FRAME_COLUMNS
from liggghts_driver.errors import ParseError
from liggghts_driver.results.binarydump import iter_binary_frames
from liggghts_driver.results.series import read_run_series

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from liggghts_driver.case import Case
    from liggghts_driver.rundir import RunDirectory


#: Columns of a frame, which has them as the deck asks for them.
_ID = FRAME_COLUMNS.index("id")
_PLACE = [FRAME_COLUMNS.index(name) for name in ("x", "y", "z")]
_VELOCITY = [FRAME_COLUMNS.index(name) for name in ("vx", "vy", "vz")]


@dataclass(frozen=True)
class Instant:
    """The particles at one step, in the order of their ids; ``(n, 3)`` arrays."""

    step: int
    positions_m: NDArray[np.float64]
    velocities_m_s: NDArray[np.float64]


def iter_instants(run: RunDirectory) -> Iterator[Instant]:
    """The frames of a run, one at a time.

    Raises
    ------
    ParseError
        If a frame is not what it should be, or the last is cut off.
    """
    reader = iter_binary_frames(run.frame_files(), FRAME_COLUMNS)
    for frame in reader:
        # As plain numbers at once: small frames are many, and a table costs more than its rows.
        rows = frame.data.to_numpy(dtype=float)
        ordered = rows[rows[:, _ID].argsort()]
        yield Instant(frame.step, ordered[:, _PLACE], ordered[:, _VELOCITY])
    if reader.truncated is not None:
        raise ParseError(str(reader.truncated))


@dataclass(frozen=True)
class Frames:
    """All instants of a run: ``(frames,)`` steps, and ``(frames, n, 3)`` arrays."""

    steps: NDArray[np.int64]
    positions_m: NDArray[np.float64]
    velocities_m_s: NDArray[np.float64]


def read_frames(run: RunDirectory) -> Frames:
    """All frames of a run that is small enough to be held at once.

    Raises
    ------
    ParseError
        If a frame is not what it should be, or the last is cut off.
    """
    instants = list(iter_instants(run))
    return Frames(
        steps=np.array([instant.step for instant in instants]),
        positions_m=np.array([instant.positions_m for instant in instants]),
        velocities_m_s=np.array([instant.velocities_m_s for instant in instants]),
    )


def volumes_past_sections(run: RunDirectory, case: Case) -> pd.DataFrame:
    """Volume of the particles past each section since the start, counted from the frames.

    Independent of the sums that the engine makes; columns as those of the series.
    """
    volumes = case.population.particle_volumes_m3
    rows = []
    for instant in iter_instants(run):
        x = instant.positions_m[:, 0]
        past = {name: float(volumes[x > at].sum()) for name, at in case.layout.sections.items()}
        rows.append({"step": instant.step, **{f"volume_{n}_m3": v for n, v in past.items()}})
    table = pd.DataFrame(rows)
    for name in case.layout.sections:
        table[f"volume_{name}_m3"] -= table[f"volume_{name}_m3"].iloc[0]
    return table


def largest_overlap_over_radius(run: RunDirectory, case: Case) -> float:
    """Largest overlap of any contact in any frame, over the radius of the smaller partner.

    nan where a place is not a number.
    """
    worst = 0.0
    piston = _piston_places(run, case)
    for instant in iter_instants(run):
        if not np.isfinite(instant.positions_m).all():
            return math.nan
        place = piston[instant.step] if case.scene.piston is not None else None
        contacts = contacts_at(instant.positions_m, case, piston_x_m=place)
        worst = max(worst, largest_over_radius(contacts))
    return worst


def _piston_places(run: RunDirectory, case: Case) -> dict[int, float]:
    """Where the piston was, by step; empty without one."""
    places = {0: case.layout.low[0]}
    if case.scene.piston is not None and run.engine_series.exists():
        series = read_run_series(run)
        places |= dict(zip(series["step"].tolist(), series["piston_x_m"].tolist(), strict=True))
    return places
