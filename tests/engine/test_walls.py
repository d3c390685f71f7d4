"""Spheres in a closed box: none leaves, and their energy falls, or stays where nothing damps."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from liggghts_driver.physics.contact import Body, elastic_duration_s

from .hertz_reference import effective_modulus
from .support import order, stepping

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .support import Outcome, Simulator, Tables

pytestmark = pytest.mark.engine

RADIUS, DENSITY, MODULUS, NU = 1.5e-3, 2500.0, 1e7, 0.25
MASS = DENSITY * 4.0 / 3.0 * math.pi * RADIUS**3
#: Hertz's k of a sphere on a plane; between equal spheres it is k / sqrt(2).
STIFFNESS = 4.0 / 3.0 * effective_modulus((MODULUS, NU), (MODULUS, NU)) * math.sqrt(RADIUS)
HALF = 0.01
SPEED = 0.1
BALL, PLANE = Body(RADIUS, MASS, MODULUS, NU), Body(math.inf, math.inf, MODULUS, NU)
#: The shortest contact is that of two spheres head-on.
CONTACT = elastic_duration_s(BALL, BALL, 2.0 * SPEED)


def gas(restitution: float, steps_per_contact: int, spheres: int = 8) -> Tables:
    """Spheres on a lattice between six walls, flying in all directions: a dozen bounces each."""
    rng = np.random.default_rng(11)
    corners = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T * HALF
    directions = rng.normal(size=(8, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    step = CONTACT / steps_per_contact
    steps = 400 * math.ceil(12.0 * 2.0 * HALF / SPEED / step / 400)
    return {
        "particles": {"density": DENSITY, "youngs_modulus": MODULUS, "poissons_ratio": NU},
        "spheres": [
            {"radius": RADIUS, "position": place.tolist(), "velocity": (SPEED * way).tolist()}
            for place, way in zip(corners[:spheres], directions[:spheres], strict=True)
        ],
        "contact": {"restitution": restitution},
        "box": {
            "low": [-HALF] * 3,
            "high": [HALF] * 3,
            "walls": ["x-", "x+", "y-", "y+", "z-", "z+"],
        },
        **stepping(step, steps, 400),
    }


def energy(outcome: Outcome) -> NDArray[np.float64]:
    """Kinetic energy and that of the contacts, (2/5) k overlap^(5/2), in each frame [J]."""
    x, v = outcome.positions_m, outcome.velocities_m_s
    walls = np.maximum(np.abs(x) + RADIUS - HALF, 0.0)
    total = MASS / 2.0 * (v**2).sum(axis=(1, 2)) + 0.4 * STIFFNESS * (walls**2.5).sum(axis=(1, 2))
    first, second = np.triu_indices(x.shape[1], 1)
    apart = np.linalg.norm(x[:, first] - x[:, second], axis=2)
    overlaps = np.maximum(2.0 * RADIUS - apart, 0.0)
    sums: NDArray[np.float64] = total + 0.4 * STIFFNESS / math.sqrt(2.0) * (overlaps**2.5).sum(
        axis=1
    )
    return sums


def deepest() -> float:
    """Overlap of a head-on impact on a wall."""
    return float((2.5 * MASS * SPEED**2 / 2.0 / STIFFNESS) ** 0.4)


def test_energy_never_grows(simulator: Simulator) -> None:
    outcomes = simulator.run_all([gas(restitution, 40) for restitution in (0.1, 0.5, 0.9)])
    for outcome in outcomes:
        total = energy(outcome)
        # Rounding. Several frames fall into each contact: a growth within it would be seen.
        assert np.diff(total).max() < 1e-12 * total[0]
        assert total[-1] < 0.2 * total[0]
        assert np.abs(outcome.positions_m).max() < HALF - RADIUS + deepest()


def test_elastic_energy_of_a_gas_is_kept(simulator: Simulator) -> None:
    """Over many contacts there is no trend."""
    outcome = simulator.run(gas(1.0, 20))
    total = energy(outcome)
    # 0.2 %: within a contact of 20 steps the energy swings by this much (below).
    assert total == pytest.approx(total[0], rel=2e-3)
    assert np.abs(outcome.positions_m).max() < HALF - RADIUS + 2.0 * deepest()


def test_elastic_energy_within_a_bounce(simulator: Simulator) -> None:
    """The scheme is of second order: so is the swing of the energy while a contact lasts."""
    resolutions = np.array([20, 40, 80, 160])
    scenes = []
    for number in resolutions:
        tables = gas(1.0, int(number), spheres=1)
        place = [0.0, 0.0, -HALF + RADIUS + 1e-5]
        tables["spheres"][0] |= {"position": place, "velocity": [0.05, 0.03, -SPEED]}
        steps = 3 * int(number)
        scenes.append(tables | stepping(CONTACT / float(number), steps, steps))
    totals = [energy(outcome) for outcome in simulator.run_all(scenes)]
    swings = [np.abs(total / total[0] - 1.0).max() for total in totals]
    # 0.1: the largest swing falls between two steps.
    assert order(resolutions, swings)[0] == pytest.approx(-2.0, abs=0.1)
    # What is left afterwards is of order 5/2 (see test_collision_order), 0.8 of it for the speed.
    for number, total in zip(resolutions, totals, strict=True):
        assert abs(total[-1] / total[0] - 1.0) < 2.0 * float(number) ** -2.5


def test_a_lone_sphere_between_two_walls(simulator: Simulator) -> None:
    """It loses e at each bounce and comes back straight: the n-th flight goes at e^n."""
    restitution = 0.8
    tables = gas(restitution, 200, spheres=1)
    tables["spheres"][0] |= {"position": [0.0, 0.001, 0.0], "velocity": [0.0, 0.0, -SPEED]}
    outcome = simulator.run(tables)
    speeds = outcome.velocities_m_s[:, 0, 2]
    gaps = HALF - RADIUS - np.abs(outcome.positions_m[:, 0, 2])
    free = speeds[gaps > 0]
    flights = [free[0], *free[1:][np.diff(np.sign(free)) != 0]]
    assert len(flights) > 4
    expected = -SPEED * (-restitution) ** np.arange(len(flights))
    # First order in the step: 0.35 / 200 for each bounce at most (see encounters).
    assert flights == pytest.approx(expected, rel=0.35 / 200 * len(flights))
    assert np.all(outcome.velocities_m_s[:, 0, :2] == 0.0)
