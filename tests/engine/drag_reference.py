"""A lone sphere in a fluid at rest, from rest, under a constant force: Eqs. 17-20 to ten digits.

Written from the paper's own equations, apart from the package's drag law.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Eq. 18: up to this Re, C_D = factor x Re^power.
EQ_18 = (
    (1.0, 24.0, -1.0),
    (400.0, 24.0, -0.646),
    (3.0e5, 0.5, 0.0),
    (2.0e6, 0.000366, 0.4275),
    (math.inf, 0.18, 0.0),
)
CRISIS = 3.0e5  # C_D falls from 0.5 to 0.080 here


@dataclass(frozen=True)
class Fall:
    """A sphere and what drives it; everything in SI."""

    radius: float
    density: float
    fluid_density: float
    viscosity: float
    force: float

    @property
    def mass(self) -> float:
        return self.density * 4.0 / 3.0 * math.pi * self.radius**3

    def reynolds(self, speed: float) -> float:
        return 2.0 * self.fluid_density * self.radius * speed / self.viscosity

    def drag(self, speed: float, branch: int) -> float:
        """Eq. 17 with one line of Eq. 18."""
        _, factor, power = EQ_18[branch]
        coefficient = factor * self.reynolds(speed) ** power if speed > 0 else 0.0
        return 0.5 * self.fluid_density * coefficient * math.pi * self.radius**2 * speed**2

    def final_branch(self) -> int:
        """The branch in which a sphere from rest ends: the first that can balance the force."""
        for branch, (up_to, _, _) in enumerate(EQ_18):
            if math.isinf(up_to) or self.drag(self._speed(up_to), branch) >= self.force:
                return branch
        raise AssertionError

    def final_speed(self) -> float:
        """Where drag balances the force."""
        branch = self.final_branch()
        highest = self._speed(min(EQ_18[branch][0], 1e12))
        return float(brentq(lambda v: self.drag(v, branch) - self.force, 0.0, highest, rtol=1e-14))

    def relaxation(self) -> float:
        """m / K at the final speed: the time scale of the approach to it."""
        return self.mass * self.final_speed() / self.force

    def speeds(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Speed at each time.

        Eq. 18 is integrated branch by branch, each up to the instant at which its last Re is
        reached, so that the integrator never steps over a jump or a kink of the law.
        """
        found = np.empty(len(times))
        start, speed = 0.0, 0.0
        for branch, (up_to, _, _) in enumerate(EQ_18):
            piece = self._piece(branch, up_to, start, speed, float(times[-1]))
            end = float(piece.t[-1])
            here = (times >= start) & (times <= end)
            found[here] = (
                np.interp(0, [0], [0])
                if not here.any()
                else piece.sol(times[here])[0] * self.final_speed()
            )
            if piece.status == 0:
                return found
            start, speed = end, self._speed(up_to)
        raise AssertionError("the last branch has no end")

    def _speed(self, reynolds: float) -> float:
        return reynolds * self.viscosity / (2.0 * self.fluid_density * self.radius)

    def _piece(self, branch: int, up_to: float, start: float, speed: float, end: float):
        scale = self.final_speed()

        def acceleration(_time: float, u: NDArray[np.float64]) -> list[float]:
            return [(self.force - self.drag(float(u[0]) * scale, branch)) / self.mass / scale]

        def leaves(_time: float, u: NDArray[np.float64]) -> float:
            return float(u[0]) * scale / self._speed(min(up_to, 1e12)) - 1.0

        leaves.terminal = True
        leaves.direction = 1.0
        return solve_ivp(
            acceleration,
            (start, end),
            [speed / scale],
            method="DOP853",
            rtol=1e-10,
            atol=1e-14,
            events=leaves,
            dense_output=True,
        )
