"""How fast particles go inside the specimen, by what counts as flowing: from a run's frames."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.deck.build import FRAME_COLUMNS
from liggghts_driver.paper import law
from liggghts_driver.results.binarydump import iter_binary_frames

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from liggghts_driver.rundir import RunDirectory
    from liggghts_driver.scene.model import Scene

    FloatArray = NDArray[np.float64]

#: Every particle inside counts, held ones too.
ALL = "all"
#: Shares of free flight above which a particle may count as flowing; the first is ours.
SHARES = (0.1, 0.5, 0.8)
#: So many frames of the second half are read: some ten thousand velocities in all.
_FRAMES = 6


def mean_speeds_m_s(run: RunDirectory) -> dict[str, float]:
    """The mean velocity along x of what is inside and counts as flowing, over the second half.

    Returns
    -------
    dict
        `ALL` and the `SHARES` as text to the mean [m/s]; empty without frames or a specimen, and
        without those above which no particle is.

    Raises
    ------
    ParseError
        If a frame is not what it should be.
    RunFolderError
        If there are frames, but no scene that can be read.
    """
    files = _second_half(run)
    if not files:
        return {}
    scene = run.read_scene()
    if scene.specimen is None or scene.pressure is None:
        return {}
    velocities_m_s = np.concatenate([_inside(path, scene) for path in files])
    free_m_s = law.free_flight_m_s(scene.pressure.gradient, scene)
    lowest = {ALL: -np.inf, **{f"{share:g}": share * free_m_s for share in SHARES}}
    counted = {name: velocities_m_s[velocities_m_s > limit] for name, limit in lowest.items()}
    return {name: float(some.mean()) for name, some in counted.items() if len(some)}


def _second_half(run: RunDirectory) -> list[Path]:
    """A few frames of the second half of a run, evenly spread, the last among them."""
    files = run.frame_files()
    if not files:
        return []
    last = run.step_of(files[-1])
    late = [path for path in files if 2 * run.step_of(path) >= last]
    chosen = np.unique(np.linspace(0, len(late) - 1, _FRAMES).round().astype(int))
    return [late[place] for place in chosen]


def _inside(path: Path, scene: Scene) -> FloatArray:
    """The velocities along x of the particles inside the specimen in a frame."""
    assert scene.specimen is not None
    frame = iter_binary_frames(path, FRAME_COLUMNS).first().data
    inside = (frame["x"] > 0.0) & (frame["x"] < scene.specimen.length)
    return frame.loc[inside, "vx"].to_numpy(np.float64)
