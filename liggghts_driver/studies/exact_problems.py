"""The problems with an exact answer that the engine is held to, all of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from liggghts_driver.studies.exact_collisions import collision_problems
from liggghts_driver.studies.exact_drags import drag_problems
from liggghts_driver.studies.exact_pistons import piston_problems

if TYPE_CHECKING:
    from liggghts_driver.studies.exact import Problem


def exact_problems(pairs: int = 48, spheres: int = 400, every: int = 1) -> list[Problem]:
    """Collisions, drag, and the piston.

    Parameters
    ----------
    pairs
        Collisions in a scene, one for each phase of the step.
    spheres
        In a fluid: so many that the engine's time can be measured.
    every
        Which values of a knob are taken: 1 all, 2 every second, the finest first.
    """
    return [
        *collision_problems(pairs, every),
        *drag_problems(spheres, every),
        *piston_problems(every),
    ]
