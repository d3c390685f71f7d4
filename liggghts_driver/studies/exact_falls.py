"""A lone sphere in a fluid at rest, solved without the engine: pushed from rest, or launched.

All in SI.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from liggghts_driver.physics.drag import BRANCHES, Branch
from liggghts_driver.physics.spheres import sphere_volume_m3

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class Immersed:
    """A sphere in a fluid at rest, and the law of its drag."""

    radius_m: float
    density_kg_m3: float
    fluid_density_kg_m3: float
    viscosity_pa_s: float
    law: tuple[Branch, ...] = BRANCHES

    @property
    def mass_kg(self) -> float:
        """Of the sphere."""
        return self.density_kg_m3 * sphere_volume_m3(self.radius_m)

    def reynolds(self, speed_m_s: float) -> float:
        """Eq. 19."""
        return speed_m_s / self.speed_at(1.0)

    def speed_at(self, reynolds: float) -> float:
        """Speed at a Reynolds number [m/s]."""
        return reynolds * self.viscosity_pa_s / (2.0 * self.fluid_density_kg_m3 * self.radius_m)

    def branch_at(self, reynolds: float) -> int:
        """Which line of Eq. 18 holds at a Reynolds number."""
        return next(n for n, branch in enumerate(self.law) if reynolds <= branch.up_to)

    def drag_n(self, speed_m_s: float, branch: int) -> float:
        """Eq. 17 with one line of Eq. 18, continued beyond its ends; none at rest."""
        if speed_m_s <= 0.0:
            return 0.0
        line = self.law[branch]
        stokes = 6.0 * np.pi * self.viscosity_pa_s * self.radius_m * speed_m_s
        return float(stokes * line.factor * self.reynolds(speed_m_s) ** line.power)


@dataclass(frozen=True)
class Launch:
    """A sphere that nothing but drag slows down, as long as it stays in one branch of Eq. 18.

    There K = K0 (v / v0)^p, and m dv/dt = -K v has a closed form.
    """

    sphere: Immersed
    speed_m_s: float

    @property
    def power(self) -> float:
        """The exponent p in K ~ v^p."""
        reynolds = self.sphere.reynolds(self.speed_m_s)
        return self.sphere.law[self.sphere.branch_at(reynolds)].power

    @property
    def relaxation_s(self) -> float:
        """The time scale tau = m / K0, of the speed at the start."""
        branch = self.sphere.branch_at(self.sphere.reynolds(self.speed_m_s))
        drag = self.sphere.drag_n(self.speed_m_s, branch)
        return self.sphere.mass_kg * self.speed_m_s / drag

    def speeds_m_s(self, times_s: ArrayLike) -> NDArray[np.float64]:
        """Speeds v0 (1 + p t / tau)^(-1/p); for p = 0, v0 exp(-t / tau)."""
        passed = np.asarray(times_s, dtype=float) / self.relaxation_s
        if self.power == 0.0:
            return np.asarray(self.speed_m_s * np.exp(-passed))
        return np.asarray(self.speed_m_s * (1.0 + self.power * passed) ** (-1.0 / self.power))

    def ways_m(self, times_s: ArrayLike) -> NDArray[np.float64]:
        """The integral of the speed; for p < 1, v0 tau (1 - (v / v0)^(1-p)) / (1 - p)."""
        slowed = self.speeds_m_s(times_s) / self.speed_m_s
        rest = 1.0 - self.power
        return np.asarray(self.speed_m_s * self.relaxation_s * (1.0 - slowed**rest) / rest)


@dataclass(frozen=True)
class Fall:
    """A sphere from rest under a constant force, on its way to the speed at which drag balances it.

    Eq. 18 is integrated branch by branch, each up to the instant at which its last Re is reached,
    so that the integrator never steps over a jump or a kink of the law.
    """

    sphere: Immersed
    force_n: float

    @cached_property
    def final_branch(self) -> int:
        """Where it ends: in the first branch whose drag can balance the force."""
        sphere = self.sphere
        return next(
            branch
            for branch, line in enumerate(sphere.law)
            if sphere.drag_n(sphere.speed_at(line.up_to), branch) >= self.force_n
        )

    @cached_property
    def final_speed_m_s(self) -> float:
        """Where drag balances the force."""
        sphere, branch = self.sphere, self.final_branch
        # Stokes' drag is the least there is: it is not as fast as twice what that would allow.
        highest = 2.0 * self.force_n / sphere.drag_n(1.0, 0)

        def excess(speed: float) -> float:
            return sphere.drag_n(speed, branch) - self.force_n

        return float(brentq(excess, 0.0, highest, rtol=1e-14))

    @property
    def relaxation_s(self) -> float:
        """The time scale m / K of the approach to the final speed."""
        return self.sphere.mass_kg * self.final_speed_m_s / self.force_n

    def motion(
        self, times_s: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Speeds and ways at times that begin with 0."""
        found = np.zeros((2, len(times_s)))
        start, state = 0.0, np.zeros(2)
        for branch in range(self.final_branch + 1):
            piece = self._piece(branch, start, state, float(times_s[-1]))
            end = float(piece.t[-1])
            here = (times_s > start) & (times_s <= end)
            if here.any():
                found[:, here] = piece.sol(times_s[here])
            start, state = end, piece.y[:, -1]
        return found[0] * self.final_speed_m_s, found[1] * self.final_speed_m_s

    def _piece(self, branch: int, start_s: float, state: NDArray[np.float64], end_s: float) -> Any:
        """Speed and way, both over the final speed, until a branch is left."""
        scale = self.final_speed_m_s
        last = self.sphere.speed_at(self.sphere.law[branch].up_to) / scale

        def change(_time: float, u: NDArray[np.float64]) -> list[float]:
            force = self.force_n - self.sphere.drag_n(float(u[0]) * scale, branch)
            return [force / self.sphere.mass_kg / scale, u[0]]

        def leaves(_time: float, u: NDArray[np.float64]) -> float:
            return float(u[0]) - last

        leaves.terminal = True  # type: ignore[attr-defined]
        return solve_ivp(
            change,
            (start_s, end_s),
            state,
            method="DOP853",
            rtol=1e-10,
            atol=1e-14,
            events=leaves,
            dense_output=True,
        )
