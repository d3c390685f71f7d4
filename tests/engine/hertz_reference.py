"""Two bodies that touch, by Hertz's law with Tsuji's damping: a textbook version, in SI."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import solve_ivp

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Contact:
    """Effective quantities of a pair, and its coefficient of restitution."""

    mass: float
    radius: float
    modulus: float
    restitution: float

    def force(self, overlap: float, approach: float) -> float:
        """Repulsion at an overlap and its rate; none where the bodies do not touch.

        Tsuji's damping is 2 sqrt(5/6) beta sqrt(S m), with the tangent stiffness S of Hertz's law
        and beta = -ln e / sqrt(ln^2 e + pi^2).
        """
        if overlap <= 0.0:
            return 0.0
        root = math.sqrt(self.radius * overlap)
        log = math.log(self.restitution)
        beta = -log / math.sqrt(log**2 + math.pi**2)
        damping = (
            2.0 * math.sqrt(5.0 / 6.0) * beta * math.sqrt(2.0 * self.modulus * root * self.mass)
        )
        return 4.0 / 3.0 * self.modulus * root * overlap + damping * approach

    def collide(self, speed: float, times: NDArray[np.float64]) -> Collision:
        """The collision that begins at time 0 with a speed of approach."""

        def motion(_time: float, u: NDArray[np.float64]) -> list[float]:
            return [u[1], -self.force(u[0], u[1]) / self.mass]

        def parts(_time: float, u: NDArray[np.float64]) -> float:
            return float(u[0])

        parts.terminal = True  # type: ignore[attr-defined]
        parts.direction = -1.0  # type: ignore[attr-defined]
        duration = 10.0 * (self.mass**2 / (self.radius * self.modulus**2 * speed)) ** 0.2
        # The first instant is left out of the integration: the overlap is zero there too.
        start = 1e-9 * duration
        solution = solve_ivp(
            motion,
            (start, duration),
            [speed * start, speed],
            method="DOP853",
            rtol=1e-10,
            atol=1e-10 * speed * start,
            events=parts,
            dense_output=True,
        )
        end = float(solution.t_events[0][0])
        overlaps = np.where(times < end, solution.sol(np.clip(times, start, end))[0], 0.0)
        return Collision(end, -float(solution.y_events[0][0][1]), overlaps)


@dataclass(frozen=True)
class Collision:
    """Duration, speed of parting, and the overlap at the times asked for."""

    duration: float
    parting: float
    overlaps: NDArray[np.float64]


def effective_modulus(one: tuple[float, float], other: tuple[float, float]) -> float:
    """E* of two materials, each given by Young's modulus and Poisson's ratio."""
    return 1.0 / sum((1.0 - ratio**2) / modulus for modulus, ratio in (one, other))
