"""A lone sphere in a fluid at rest, from rest, under a constant force: Eqs. 17-20 to ten digits.

Eq. 18 is written from the paper, apart from the package's drag law; the equation of motion is
integrated by the package's study of exact problems. All in SI.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.physics.drag import Branch
from liggghts_driver.studies import exact_falls
from liggghts_driver.studies.exact_falls import Immersed

from .support import stepping

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from .support import Outcome, Tables

#: Eq. 18: up to this Re, C_D = factor x Re^power. Above the last end lies nothing of interest.
EQ_18 = (
    (1.0, 24.0, -1.0),
    (400.0, 24.0, -0.646),
    (3.0e5, 0.5, 0.0),
    (2.0e6, 0.000366, 0.4275),
    (1.0e12, 0.18, 0.0),
)
#: The branch behind the drag crisis: at Re = 3e5, C_D falls from 0.5 to 0.080.
AFTER_CRISIS = 3


#: The same in the package's words, f = C_D Re / 24.
LAW = tuple(Branch(up_to, factor / 24.0, power + 1.0) for up_to, factor, power in EQ_18)


@dataclass(frozen=True)
class Fall:
    """A sphere, its fluid, and what drives it."""

    radius: float
    density: float
    fluid_density: float
    viscosity: float
    force: float

    @cached_property
    def sphere(self) -> Immersed:
        return Immersed(self.radius, self.density, self.fluid_density, self.viscosity, LAW)

    @cached_property
    def exact(self) -> exact_falls.Fall:
        return exact_falls.Fall(self.sphere, self.force)

    @property
    def mass(self) -> float:
        return self.sphere.mass_kg

    def reynolds(self, speed: float) -> float:
        return self.sphere.reynolds(speed)

    def drag(self, speed: float, branch: int) -> float:
        return self.sphere.drag_n(speed, branch)

    def speed_at(self, reynolds: float) -> float:
        return self.sphere.speed_at(reynolds)

    @property
    def final_branch(self) -> int:
        return self.exact.final_branch

    @property
    def final_speed(self) -> float:
        return self.exact.final_speed_m_s

    @property
    def final_reynolds(self) -> float:
        return self.reynolds(self.final_speed)

    @property
    def relaxation(self) -> float:
        return self.exact.relaxation_s

    def speeds(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Speed at each of the times, which begin with 0, over the final speed."""
        return self.exact.motion(times)[0] / self.final_speed


def pushed(
    reynolds: float, rng: np.random.Generator, spread: float = 1.4, count: int = 6
) -> list[Fall]:
    """Spheres in one random fluid under one random gradient, the middle ones bound for some Re.

    Viscosity, both densities and the radius are log-uniform; the gradient follows from Re. The
    radii cover a factor of ``spread`` on both sides.
    """
    viscosity, radius = 10.0 ** rng.uniform(-4.0, 0.0), 10.0 ** rng.uniform(-4.0, -2.0)
    fluid_density, density = 10.0 ** rng.uniform(2.0, 4.0), 10.0 ** rng.uniform(2.5, 4.3)
    alone = Fall(radius, density, fluid_density, viscosity, 1.0)
    branch = next(n for n, (up_to, _, _) in enumerate(EQ_18) if reynolds <= up_to)
    gradient = alone.drag(alone.speed_at(reynolds), branch) / (2.0 * math.pi * radius**3)
    return [
        Fall(r, density, fluid_density, viscosity, 2.0 * math.pi * r**3 * gradient)  # Eq. 20
        for r in radius * np.geomspace(1.0 / spread, spread, count)
    ]


def scene(falls: Sequence[Fall], step_s: float, steps: int, frames: int, drag: Tables) -> Tables:
    """All of them side by side in one box, each on a lane of its own."""
    first = falls[0]
    room = 2.0 * max(fall.radius for fall in falls)
    way = step_s * steps * max(fall.final_speed for fall in falls)
    return {
        "fluid": {"density": first.fluid_density, "viscosity": first.viscosity},
        # They never touch. So soft a material keeps the bound of the contacts out of the way.
        "particles": {"density": first.density, "youngs_modulus": 1.0, "poissons_ratio": 0.25},
        "spheres": [
            {"radius": fall.radius, "position": [0.0, 2.0 * room * lane, 0.0]}
            for lane, fall in enumerate(falls)
        ],
        "pressure": {"gradient": first.force / (2.0 * math.pi * first.radius**3)},
        "drag": drag,
        "contact": {"restitution": 0.5},
        "box": {
            "low": [-room, -room, -room],
            "high": [1.1 * way + room, 2.0 * room * len(falls), room],
        },
        **stepping(step_s, steps, frames),
    }


def errors(outcome: Outcome, falls: Sequence[Fall]) -> NDArray[np.float64]:
    """Largest error of each sphere's velocity in any frame, over its final speed."""
    exact = np.array([fall.speeds(outcome.times_s) for fall in falls]).T
    final = np.array([fall.final_speed for fall in falls])
    found: NDArray[np.float64] = np.abs(outcome.velocities_m_s[:, :, 0] / final - exact).max(axis=0)
    return found
