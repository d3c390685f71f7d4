"""A lone sphere in a fluid at rest, from rest, under a constant force: Eqs. 17-20 to ten digits.

Written from the paper's own equations, apart from the package's drag law. All in SI.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

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


@dataclass(frozen=True)
class Fall:
    """A sphere, its fluid, and what drives it."""

    radius: float
    density: float
    fluid_density: float
    viscosity: float
    force: float

    @property
    def mass(self) -> float:
        return self.density * 4.0 / 3.0 * math.pi * self.radius**3

    def reynolds(self, speed: float) -> float:
        """Eq. 19."""
        return 2.0 * self.fluid_density * self.radius * speed / self.viscosity

    def drag(self, speed: float, branch: int) -> float:
        """Eq. 17 with one line of Eq. 18, continued beyond its ends."""
        _, factor, power = EQ_18[branch]
        if speed <= 0.0:
            return 0.0
        coefficient = factor * self.reynolds(speed) ** power
        return 0.5 * self.fluid_density * coefficient * math.pi * self.radius**2 * speed**2

    def speed_at(self, reynolds: float) -> float:
        return reynolds * self.viscosity / (2.0 * self.fluid_density * self.radius)

    @cached_property
    def final_branch(self) -> int:
        """Where a sphere from rest ends: in the first branch whose drag can balance the force."""
        return next(
            branch
            for branch, (up_to, _, _) in enumerate(EQ_18)
            if self.drag(self.speed_at(up_to), branch) >= self.force
        )

    @cached_property
    def final_speed(self) -> float:
        branch = self.final_branch
        highest = self.speed_at(EQ_18[branch][0])
        return float(brentq(lambda v: self.drag(v, branch) - self.force, 0.0, highest, rtol=1e-14))

    @property
    def final_reynolds(self) -> float:
        return self.reynolds(self.final_speed)

    @property
    def relaxation(self) -> float:
        """m / K at the final speed: the time scale of the approach to it."""
        return self.mass * self.final_speed / self.force

    def speeds(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Speed at each of the times, which begin with 0, over the final speed.

        Eq. 18 is integrated branch by branch, each up to the instant at which its last Re is
        reached, so that the integrator never steps over a jump or a kink of the law.
        """
        found = np.zeros(len(times))
        start, speed = 0.0, 0.0
        for branch in range(self.final_branch + 1):
            piece = self._piece(branch, start, speed, float(times[-1]))
            end = float(piece.t[-1])
            here = (times > start) & (times <= end)
            if here.any():
                found[here] = piece.sol(times[here])[0]
            start, speed = end, float(piece.y[0, -1])
        return found

    def _piece(self, branch: int, start: float, speed: float, end: float):
        scale = self.final_speed
        last = self.speed_at(EQ_18[branch][0]) / scale

        def acceleration(_time: float, u: NDArray[np.float64]) -> list[float]:
            return [(self.force - self.drag(float(u[0]) * scale, branch)) / self.mass / scale]

        def leaves(_time: float, u: NDArray[np.float64]) -> float:
            return float(u[0]) - last

        leaves.terminal = True  # type: ignore[attr-defined]
        return solve_ivp(
            acceleration,
            (start, end),
            [speed],
            method="DOP853",
            rtol=1e-10,
            atol=1e-14,
            events=leaves,
            dense_output=True,
        )


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
