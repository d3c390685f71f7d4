"""The map of steps: what a contact loses or gains by itself, for steps up to more than a contact.

Pairs of spheres meet at all phases of a step, as in the study of exact problems. Of damped ones the
error of the restitution is shown, of elastic ones the energy after the contact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.physics.contact import Body, contact_duration_s
from liggghts_driver.scene import make_scene
from liggghts_driver.studies.energy import read_ran
from liggghts_driver.studies.exact_collisions import (
    APPROACH_M_S,
    DAMPED,
    MASS_KG,
    MODULUS_PA,
    POISSON,
    RADIUS_M,
    collision_scene,
)
from liggghts_driver.studies.tasks import run_folder, task_of
from liggghts_driver.sweeps.work import is_done

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from liggghts_driver.scene.model import Scene
    from liggghts_driver.studies.energy import Ran
    from liggghts_driver.sweeps.task import Outcome, Task

#: Steps over the duration of a contact after Eq. 21.
FRACTIONS = (0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.14, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0, 1.5)
PAIRS = 24
#: A run lasts two contacts, and steps for the flight before and the frames.
_CONTACTS = 2.0
_LEAST_STEPS = 10
#: A step of the scene that is taken and given another.
_ANY = 0.1


@dataclass(frozen=True)
class Point:
    """One step of the map.

    Attributes
    ----------
    step_over_contact
        The step over the duration of a contact after Eq. 21.
    restitution
        0.5 for the damped pairs, 1 for the elastic ones.
    mean, largest
        Damped: error of the restitution; elastic: energy gained over that before. Absolute values:
        of the mean over all phases of the step, and of the worst phase; nan where the run was
        stopped.
    """

    step_over_contact: float
    restitution: float
    mean: float
    largest: float


def map_tasks(runs: Path, fractions: Sequence[float] = FRACTIONS) -> list[Task]:
    """A run for each point of the map."""
    return [
        task_of(f"map, restitution {e:g}, step {f:g} of a contact", scene, folder)
        for (e, f), (scene, folder) in _runs(runs, fractions).items()
    ]


def map_points(runs: Path, fractions: Sequence[float] = FRACTIONS) -> list[Point]:
    """What the runs say, those that were stopped too."""
    return [
        point_of(read_ran(folder), restitution, fraction)
        if is_done(folder)
        else Point(fraction, restitution, math.nan, math.nan)
        for (restitution, fraction), (_, folder) in _runs(runs, fractions).items()
    ]


def point_of(ran: Ran, restitution: float, fraction: float) -> Point:
    """One point, from the speeds before and after of every pair."""
    velocities = ran.velocities_m_s[-1, :, 0]
    parting = (velocities[1::2] - velocities[::2]) / APPROACH_M_S
    wrong = parting - restitution if restitution < 1.0 else parting**2 - 1.0
    return Point(fraction, restitution, float(abs(wrong.mean())), float(np.abs(wrong).max()))


def run_map(
    runs: Path,
    run: Callable[[Sequence[Task]], Mapping[str, Outcome]],
    fractions: Sequence[float] = FRACTIONS,
) -> list[Point]:
    """Run what is not there yet, and read all of it."""
    run(map_tasks(runs, fractions))
    return map_points(runs, fractions)


def _runs(runs: Path, fractions: Sequence[float]) -> dict[tuple[float, float], tuple[Scene, Path]]:
    found = {}
    for restitution in (DAMPED, 1.0):
        for fraction in fractions:
            scene = _scene(restitution, fraction)
            found[restitution, fraction] = (scene, run_folder(scene, runs))
    return found


def _scene(restitution: float, fraction: float) -> Scene:
    """The pairs of the exact study, with a step that may be longer than a contact."""
    body = Body(RADIUS_M, MASS_KG, MODULUS_PA, POISSON)
    step_s = fraction * contact_duration_s(body, body, APPROACH_M_S)
    tables = collision_scene(restitution, _ANY, 1.0, PAIRS).model_dump(
        mode="json", exclude_none=True
    )
    # They touch from the third step on, each pair at another phase of it.
    gaps = (2.0 + (np.arange(PAIRS) + 0.5) / PAIRS) * APPROACH_M_S * step_s
    for sphere, gap in zip(tables["spheres"], np.repeat(gaps, 2).tolist(), strict=True):
        side = np.sign(sphere["position"][0])
        sphere["position"][0] = float(side * (RADIUS_M + gap / 2.0))
    steps = round(_CONTACTS / fraction) + _LEAST_STEPS
    tables["time"] = {"duration": step_s * steps, "step": step_s, "step_fraction": 1.0}
    tables["output"] = {"samples": _LEAST_STEPS, "frames": _LEAST_STEPS, "images": 0}
    return make_scene(tables, "two spheres meet")
