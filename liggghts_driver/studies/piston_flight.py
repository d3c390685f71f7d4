"""The piston as long as nothing can have touched it: there Newton's law has an exact answer."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.results.series import fastest_piston_m_s

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from liggghts_driver.studies.energy import Ran

    Array = NDArray[np.float64]

#: The engine moves the piston with the velocity after the step's kick, half a step ahead: after n
#: steps it has gone 1 / n too far.
FEWEST_STEPS = 40


def free_until_s(ran: Ran) -> float:
    """The last frame up to which no sphere can have touched the piston; 0 where one may at once.

    From one frame to the next a gap closes by at most the way that the fastest sphere and the
    piston go in that time.
    """
    fastest = float(ran.series["largest_speed_m_s"].max()) + fastest_piston_m_s(ran.series)
    reach = fastest * float(np.diff(ran.times_s).max(initial=0.0))
    touched = (_nearest_x_m(ran) - ran.piston_x_m <= reach) | _felt(ran)
    if not touched.any():
        return float(ran.times_s[-1])
    return float(ran.times_s[max(0, int(touched.argmax()) - 1)])


def off_newton(ran: Ran) -> float | None:
    """How far the piston is from a t^2 / 2 as long as it is free, as a share of that way.

    None where that is over within ``FEWEST_STEPS``.
    """
    assert ran.case.scene.piston is not None
    until_s = free_until_s(ran)
    if until_s < FEWEST_STEPS * ran.case.time.step_s:
        return None
    time, place = ran.series["time_s"].to_numpy(), ran.series["piston_x_m"].to_numpy()
    exact = 0.5 * ran.case.scene.piston.acceleration * until_s**2
    gone = float(np.interp(until_s, time, place)) - float(place[0])
    return abs(gone / exact - 1.0)


def _nearest_x_m(ran: Ran) -> Array:
    """Where the sphere nearest to the piston begins, in each frame."""
    population, count = ran.case.population, ran.case.population.particles
    moving = ran.positions_m[:, :, 0] - population.particle_radii_m
    fixed = population.centres_m[count:, 0] - population.radii_m[count:]
    return np.asarray(np.minimum(moving.min(axis=1, initial=np.inf), fixed.min(initial=np.inf)))


def _felt(ran: Ran) -> NDArray[np.bool_]:
    """Whether the piston had felt a force by each frame."""
    felt = np.maximum.accumulate(ran.series["piston_force_n"].to_numpy() != 0.0)
    return np.asarray(ran.at_frames(felt.astype(float)) > 0.0)
