"""Rolling resistance: a sphere that rolls comes to rest, one that cannot roll slides as a block.

The engine's epsd2 adds a torque that opposes rolling: a spring of stiffness kt r^2 (kt that of the
tangential contact), cut off at mu_R r N. It has no dashpot, and no factor of its own: the torque of
a sphere that rolls on a plane is mu_R r N, with r its own radius.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from liggghts_driver.physics.contact import Body, elastic_duration_s

from .support import order, stepping
from .test_friction import DENSITY, GRAVITY, MASS, MODULUS, NU, OVERLAP, RADIUS, SPEED

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .support import Outcome, Simulator, Tables

pytestmark = pytest.mark.engine

#: Distance of the centre from the contact, which the engine puts midway into the overlap.
LEVER = RADIUS - OVERLAP / 2.0
#: Stiffness of the tangential contact, 8 G* sqrt(r d), 1/G* = twice 2 (2 - nu)(1 + nu) / E.
TANGENTIAL = 8.0 * MODULUS / (4.0 * (2.0 - NU) * (1.0 + NU)) * math.sqrt(RADIUS * OVERLAP)
FRAMES = 200
FRACTIONS = np.array([1 / 20, 1 / 40, 1 / 80])


def moving(friction: float, rolling: float, seconds: float, fraction: float, spin: float) -> Tables:
    """A sphere that lies on the plane z = 0, sent along it with a spin about y."""
    ball, plane = Body(RADIUS, MASS, MODULUS, NU), Body(math.inf, math.inf, MODULUS, NU)
    step = fraction * elastic_duration_s(ball, plane, SPEED)
    steps = FRAMES * math.ceil(seconds / step / FRAMES)
    return {
        "particles": {"density": DENSITY, "youngs_modulus": MODULUS, "poissons_ratio": NU},
        "spheres": [
            {
                "radius": RADIUS,
                "position": [0.0, 0.0, RADIUS - OVERLAP],
                "velocity": [SPEED, 0.0, 0.0],
                "spin": [0.0, spin, 0.0],
            }
        ],
        "gravity": {"acceleration": [0.0, 0.0, -GRAVITY]},
        "contact": {"restitution": 0.5, "friction": friction, "rolling_friction": rolling},
        "box": {"low": [-0.02, -0.02, 0.0], "high": [0.05, 0.02, 0.01], "walls": ["z-"]},
        **stepping(step, steps, FRAMES),
    }


def deceleration(rolling: float) -> float:
    """Of a sphere that rolls without slipping against a torque T = mu_R r m g.

    m v' = -F and (2/5) m r^2 w' = F c - T with v = w c, c the lever, give
    v' = -T / (m c (1 + 2/5 (r / c)^2)), which is 5/7 mu_R g for a rigid sphere.
    """
    return rolling * RADIUS * GRAVITY / LEVER / (1.0 + 0.4 * (RADIUS / LEVER) ** 2)


def along(outcome: Outcome) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Place and velocity along x in each frame."""
    return outcome.positions_m[:, 0, 0], outcome.velocities_m_s[:, 0, 0]


def test_rolling_slows_down(simulator: Simulator) -> None:
    """The rate is that of the cut-off torque, whatever the friction that keeps it from slipping."""
    for friction, rolling in ((0.5, 0.05), (0.5, 0.1), (0.9, 0.2)):
        until = SPEED / deceleration(rolling)
        outcome = simulator.run(moving(friction, rolling, 0.6 * until, 1 / 80, SPEED / LEVER))
        _, speeds = along(outcome)
        steady = outcome.times_s > 0.1 * until
        rate = np.polyfit(outcome.times_s[steady], speeds[steady], 1)[0]
        # 1e-5: the last of the oscillation of the tangential spring, which takes up the force.
        assert rate == pytest.approx(-deceleration(rolling), rel=1e-5)
        # The textbook's rigid sphere: right to the overlap over the radius.
        assert rate == pytest.approx(-5.0 / 7.0 * rolling * GRAVITY, rel=OVERLAP / RADIUS)


def test_rolling_to_rest(simulator: Simulator) -> None:
    """It stops after v^2 / 2a, and stays.

    The springs' part in it: the torque builds up, and is given back, while the sphere rolls as far
    as they stretch, mu_R m g / kt each.
    """
    rolling = 0.1
    until = SPEED / deceleration(rolling)
    outcome = simulator.run(moving(0.5, rolling, 1.5 * until, 1 / 40, SPEED / LEVER))
    places, speeds = along(outcome)
    way = SPEED**2 / (2.0 * deceleration(rolling))
    stretch = rolling * MASS * GRAVITY / TANGENTIAL
    rests = outcome.times_s > 1.1 * until
    # Both springs, at both ends: 5e-5 of the way.
    assert places[rests] == pytest.approx(way, abs=4.0 * stretch)
    # The model has no dashpot: what is left swings in the springs, on their own time scale.
    assert np.abs(speeds[rests]).max() < stretch * math.sqrt(TANGENTIAL / MASS)


def test_without_rolling_resistance_it_goes_on(simulator: Simulator) -> None:
    """Set off as it rolls, with nothing to slow it, it keeps its speed."""
    tables = moving(0.5, 0.0, 0.05, 1 / 40, SPEED / LEVER)
    _, speeds = along(simulator.run(tables))
    # 1e-9: rounding of the contact's velocity, v - w c, which friction takes for a slip.
    assert speeds == pytest.approx(SPEED, rel=1e-9)


def test_a_sphere_that_cannot_roll_slides_as_a_block(simulator: Simulator) -> None:
    """With a coefficient of 100 the rolling spring never gives way: v^2 / (2 mu g), then rest.

    In a contact's first step the engine's tangential damping acts without Coulomb's limit (see
    the sliding in the tests of friction): what that takes of the way goes with the step.
    """
    friction = 0.3
    until = SPEED / (friction * GRAVITY)
    outcomes = simulator.run_all(
        [moving(friction, 100.0, 1.5 * until, fraction, 0.0) for fraction in FRACTIONS]
    )
    stretch = friction * MASS * GRAVITY / TANGENTIAL
    missing = []
    for outcome in outcomes:
        places, speeds = along(outcome)
        slides = (outcome.times_s > 0) & (outcome.times_s < 0.9 * until)
        rates = np.diff(speeds[slides]) / np.diff(outcome.times_s[slides])
        # 1e-9: rounding of differences of a thousandth of the speed.
        assert rates == pytest.approx(-friction * GRAVITY, rel=1e-9)
        # From the first frame on it is a block to the last stretch of both springs.
        way = speeds[1] ** 2 / (2.0 * friction * GRAVITY)
        rests = outcome.times_s > 1.1 * until
        assert places[rests] - places[1] == pytest.approx(way, abs=4.0 * stretch)
        missing.append(SPEED**2 / (2.0 * friction * GRAVITY) - places[-1])
    # 0.1: the springs' part, 4 stretches, is up to 7 % of the least of these.
    assert order(FRACTIONS, missing)[0] == pytest.approx(1.0, abs=0.1)
