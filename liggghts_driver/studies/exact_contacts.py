"""Bodies that touch, solved without the engine: one collision, and a row between piston and wall.

Hertz's law with Tsuji's damping as textbooks have it, integrated to ten digits. All in SI.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import solve_ivp

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Digits to which motions are integrated.
_RELATIVE = 1e-10


@dataclass(frozen=True)
class Collision:
    """Duration, speed of parting, and the overlaps at the times asked for."""

    duration_s: float
    parting_m_s: float
    overlaps_m: NDArray[np.float64]


@dataclass(frozen=True)
class Contact:
    """Effective quantities of a pair, and its coefficient of restitution."""

    mass_kg: float
    radius_m: float
    modulus_pa: float
    restitution: float

    def force_n(self, overlap_m: float, approach_m_s: float) -> float:
        """Repulsion at an overlap and its rate; none where the bodies do not touch.

        Tsuji's damping is 2 sqrt(5/6) beta sqrt(S m), with the tangent stiffness S of Hertz's law
        and beta = -ln e / sqrt(ln^2 e + pi^2).
        """
        if overlap_m <= 0.0:
            return 0.0
        root = math.sqrt(self.radius_m * overlap_m)
        log = math.log(self.restitution)
        beta = -log / math.sqrt(log**2 + math.pi**2)
        stiffness = 2.0 * self.modulus_pa * root
        damping = 2.0 * math.sqrt(5.0 / 6.0) * beta * math.sqrt(stiffness * self.mass_kg)
        return 4.0 / 3.0 * self.modulus_pa * root * overlap_m + damping * approach_m_s

    def elastic_energy_j(self, overlaps_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Work that Hertz's force has stored at overlaps; none where the bodies do not touch."""
        depth = np.maximum(overlaps_m, 0.0)
        factor = 8.0 / 15.0 * self.modulus_pa * math.sqrt(self.radius_m)
        return np.asarray(factor * depth**2.5)

    def collide(self, speed_m_s: float, times_s: NDArray[np.float64]) -> Collision:
        """The collision that begins at time 0 with a speed of approach."""

        def motion(_time: float, u: NDArray[np.float64]) -> list[float]:
            return [u[1], -self.force_n(u[0], u[1]) / self.mass_kg]

        def parts(_time: float, u: NDArray[np.float64]) -> float:
            return float(u[0])

        parts.terminal = True  # type: ignore[attr-defined]
        parts.direction = -1.0  # type: ignore[attr-defined]
        stiffness = self.radius_m * self.modulus_pa**2
        longest = 10.0 * (self.mass_kg**2 / (stiffness * speed_m_s)) ** 0.2
        # The first instant is left out of the integration: the overlap is zero there too.
        start = 1e-9 * longest
        solution = solve_ivp(
            motion,
            (start, longest),
            [speed_m_s * start, speed_m_s],
            method="DOP853",
            rtol=_RELATIVE,
            atol=_RELATIVE * speed_m_s * start,
            events=parts,
            dense_output=True,
        )
        assert solution.sol is not None
        assert solution.t_events is not None
        assert solution.y_events is not None
        end = float(solution.t_events[0][0])
        overlaps = np.where(times_s < end, solution.sol(np.clip(times_s, start, end))[0], 0.0)
        return Collision(end, -float(solution.y_events[0][0][1]), overlaps)


@dataclass(frozen=True)
class Row:
    """Equal spheres that touch, in a row between a piston and a wall, all at rest at first.

    Attributes
    ----------
    spheres
        Their number.
    radius_m, sphere_kg
        Of each.
    piston_kg, force_n
        Mass of the piston, and the force that pushes it towards the wall.
    plane, pair
        The contacts of a sphere with piston or wall, and of two spheres.
    """

    spheres: int
    radius_m: float
    sphere_kg: float
    piston_kg: float
    force_n: float
    plane: Contact
    pair: Contact

    def motion(self, times_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Places and then velocities of piston and spheres, ``(2 spheres + 2, times)``."""
        count = self.spheres + 1
        masses = np.array([self.piston_kg, *[self.sphere_kg] * self.spheres])
        rest = np.array([0.0, *self.radius_m * (1.0 + 2.0 * np.arange(self.spheres))])

        def change(_time: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
            pushes = self._pushes(state[:count], state[count:])
            forces = np.append(0.0, pushes[:-1]) - pushes
            forces[0] += self.force_n
            return np.concatenate([state[count:], forces / masses])

        solution = solve_ivp(
            change,
            (0.0, float(times_s[-1])),
            np.concatenate([rest, np.zeros(count)]),
            method="DOP853",
            rtol=_RELATIVE,
            atol=1e-15,
            t_eval=times_s,
        )
        return np.asarray(solution.y)

    def _pushes(
        self, places_m: NDArray[np.float64], velocities_m_s: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Force of each contact, from the piston's to the wall's."""
        contacts = [self.plane, *[self.pair] * (self.spheres - 1), self.plane]
        # Distances at which neighbours, the wall being the last, just touch.
        reach = self.radius_m * np.array([1.0, *[2.0] * (self.spheres - 1), 1.0])
        wall = 2.0 * self.radius_m * self.spheres
        overlaps = reach - np.diff(np.append(places_m, wall))
        approaches = -np.diff(np.append(velocities_m_s, 0.0))
        met = zip(contacts, overlaps, approaches, strict=True)
        return np.array([contact.force_n(float(d), float(v)) for contact, d, v in met])
