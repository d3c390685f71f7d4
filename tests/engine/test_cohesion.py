"""Cohesion: how far bodies sink into each other under a load, and which load parts them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pytest

from liggghts_driver.physics.contact import (
    Body,
    effective_modulus_pa,
    effective_radius_m,
    pull_off_force_n,
)

from .support import stepping

if TYPE_CHECKING:
    from .support import Simulator, Tables

pytestmark = pytest.mark.engine

RADIUS, DENSITY, MODULUS, NU = 1.5e-3, 2500.0, 1e7, 0.25
MASS = DENSITY * 4.0 / 3.0 * math.pi * RADIUS**3
BALL = Body(RADIUS, MASS, MODULUS, NU)
#: An energy density of so much of E* makes the overlap at pull-off 1e-3 of r*, (pi C / E*)^2.
SOFTNESS = math.sqrt(1e-3) / math.pi


@dataclass(frozen=True)
class Hold:
    """A sphere below a fixed body that it sticks to: a grain, or a wall."""

    name: str
    other: Body

    @property
    def radius(self) -> float:
        """Effective radius."""
        return effective_radius_m(BALL, self.other)

    @property
    def energy_density(self) -> float:
        """Of the cohesion, for the overlaps asked for."""
        return SOFTNESS * effective_modulus_pa(BALL, self.other)

    @property
    def pull_off(self) -> float:
        """Load that parts them."""
        return pull_off_force_n(BALL, self.other, self.energy_density)

    @property
    def last_overlap(self) -> float:
        """Overlap at which they part."""
        return self.radius * (math.pi * SOFTNESS) ** 2

    @property
    def period(self) -> float:
        """Of small oscillations about the overlap without a load, where the slope is pi r* C."""
        return 2.0 * math.pi * math.sqrt(MASS / (math.pi * self.radius * self.energy_density))

    def force(self, overlap: float) -> float:
        """Repulsion less attraction, with the exact area of the circle."""
        r, modulus = self.radius, effective_modulus_pa(BALL, self.other)
        apart = RADIUS + self.other.radius_m - overlap
        if math.isinf(apart):
            square = RADIUS**2 - (RADIUS - overlap) ** 2
        else:
            # Place of the circle along the line of centres.
            place = (apart**2 + RADIUS**2 - self.other.radius_m**2) / (2.0 * apart)
            square = RADIUS**2 - place**2
        hertz = 4.0 / 3.0 * modulus * math.sqrt(r * overlap) * overlap
        return hertz - self.energy_density * math.pi * square

    def overlap(self, load: float) -> float:
        """Overlap at rest under a load that presses, in units of the pull-off force.

        With u^2 = d / d_pull-off, Hertz and the circle's area give 2 u^3 - 3 u^2 = load. Put
        u = 1/2 + t: 4 t^3 - 3 t = 2 load + 1, the formula of the tripled angle.
        """
        value = 2.0 * load + 1.0
        third = math.acos(value) / 3.0 if value <= 1.0 else math.acosh(value) / 3.0
        t = math.cos(third) if value <= 1.0 else math.cosh(third)
        return self.last_overlap * (0.5 + t) ** 2


HOLDS = [
    Hold("equal grain", Body(RADIUS, math.inf, MODULUS, NU)),
    Hold("large soft grain", Body(6e-3, math.inf, MODULUS / 4, 0.3)),
    Hold("wall", Body(math.inf, math.inf, MODULUS, NU)),
]
BODIES = pytest.mark.parametrize("hold", HOLDS, ids=lambda hold: hold.name)


def hanging(hold: Hold, load: float, overlap: float, periods: float) -> Tables:
    """A sphere at rest under a load in units of the pull-off force; above zero it presses.

    The load is its weight: gravity pulls it from the body above it, or pushes it there.
    """
    gap = RADIUS - overlap
    steps = 10 * math.ceil(20.0 * periods)
    tables: Tables = {
        "particles": {"density": DENSITY, "youngs_modulus": MODULUS, "poissons_ratio": NU},
        "spheres": [{"radius": RADIUS, "position": [0.0, 0.0, -gap]}],
        "gravity": {"acceleration": [0.0, 0.0, load * hold.pull_off / MASS]},
        # Strongly damped, so that it comes to rest.
        "contact": {
            "restitution": 0.06,
            "cohesion_energy_density": hold.energy_density,
        },
        "box": {"low": [-0.02, -0.02, -0.06], "high": [0.02, 0.02, 0.0]},
        **stepping(hold.period / 200.0, steps),
    }
    if math.isinf(hold.other.radius_m):
        tables["box"]["walls"] = ["z+"]
        return tables
    radius = hold.other.radius_m
    grain = {"kind": "grain", "radius": radius, "position": [0.0, 0.0, radius]}
    tables["spheres"].append(grain)
    tables["grains"] = {
        "youngs_modulus": hold.other.youngs_modulus_pa,
        "poissons_ratio": hold.other.poissons_ratio,
    }
    tables["box"]["high"] = [0.02, 0.02, 0.02]
    return tables


@BODIES
def test_overlap_under_a_load(simulator: Simulator, hold: Hold) -> None:
    """Pulled, left alone, pressed: each from the overlap of no load, to the closed form."""
    loads = np.array([-0.9, -0.5, 0.0, 1.0, 30.0])
    start = hold.overlap(0.0)
    outcomes = simulator.run_all([hanging(hold, load, start, 20.0) for load in loads])
    for load, outcome in zip(loads, outcomes, strict=True):
        overlap = RADIUS + outcome.positions_m[-1, 0, 2]
        # With the exact circle the forces balance to what is left of the motion, which the
        # damping has taken to less than a millionth of the overlap.
        assert hold.force(overlap) == pytest.approx(load * hold.pull_off, abs=1e-5 * hold.pull_off)
        # The closed form takes 2 pi r* d for the circle, too large by at most e = d / 2r* of
        # itself, that of a plane. 2 u^3 - 3 u^2 (1 - e) = load moves d by -e d / (u - 1): most
        # near the pull-off, where the contact is softest. A tenth more for the second order.
        expected = hold.overlap(load)
        u = math.sqrt(expected / hold.last_overlap)
        error = expected / (2.0 * hold.radius) / (u - 1.0)
        assert overlap == pytest.approx(expected, rel=1.1 * error), load
        assert overlap < expected


def test_overlap_without_a_load_is_nine_quarters() -> None:
    """The closed form itself: 9/4 of the last overlap without a load, all of it at pull-off."""
    hold = HOLDS[0]
    assert hold.overlap(0.0) == pytest.approx(2.25 * hold.last_overlap, rel=1e-15)
    # The cosine is flat there: a rounding of the load counts with its root.
    assert hold.overlap(-1.0) == pytest.approx(hold.last_overlap, rel=1e-7)


@BODIES
def test_pull_off(simulator: Simulator, hold: Hold) -> None:
    """Held at 1 % under the pull-off force, let go at 1 % above it.

    Both start at rest at the overlap of the pull-off, where the hold is strongest. The closed form
    is right to (3/2) d / r* = 0.15 % here, well inside the bracket.
    """
    loads = (-0.99, -1.01)
    scenes = [hanging(hold, load, hold.last_overlap, 40.0) for load in loads]
    held, fallen = simulator.run_all(scenes)
    assert RADIUS + held.positions_m[-1, 0, 2] > hold.last_overlap
    # Falling is free after the parting, which takes some periods.
    assert RADIUS + fallen.positions_m[-1, 0, 2] < 0.0
    assert fallen.velocities_m_s[-1, 0, 2] < 0.0
    gravity = 1.01 * hold.pull_off / MASS
    times, speeds = fallen.times_s, fallen.velocities_m_s[:, 0, 2]
    # 1e-9: rounding of a difference. There is no attraction across the gap.
    assert (speeds[-1] - speeds[-2]) / (times[-1] - times[-2]) == pytest.approx(-gravity, rel=1e-9)


def test_nothing_is_attracted_across_a_gap(simulator: Simulator) -> None:
    """A sphere at rest, a thousandth of an overlap away, stays where it is to the last bit."""
    for hold in HOLDS:
        tables = hanging(hold, 0.0, -1e-3 * hold.last_overlap, 5.0)
        del tables["gravity"]
        outcome = simulator.run(tables)
        assert np.all(outcome.positions_m == outcome.positions_m[0])
        assert np.all(outcome.velocities_m_s == 0.0)


def test_two_particles_stick_as_a_particle_to_a_grain(simulator: Simulator) -> None:
    """Without a load, and with friction and rolling resistance in the contact model too."""
    hold = HOLDS[0]
    tables = hanging(hold, 0.0, hold.overlap(0.0), 20.0)
    del tables["gravity"], tables["grains"]
    tables["spheres"] = [
        {"radius": RADIUS, "position": [0.0, 0.0, sign * (RADIUS - hold.last_overlap / 2.0)]}
        for sign in (-1.0, 1.0)
    ]
    tables["contact"] |= {"friction": 0.5, "rolling_friction": 0.1}
    outcome = simulator.run(tables)
    low, high = outcome.positions_m[-1, :, 2]
    expected = hold.overlap(0.0)
    # As above, with u = 3/2 where there is no load.
    assert 2.0 * RADIUS - (high - low) == pytest.approx(expected, rel=1.1 * expected / hold.radius)
