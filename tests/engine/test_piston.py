"""The piston is a rigid body of mass M, pushed by M a and by what it touches: Newton's law.

The engine's servo is a leap-frog that starts half a step late: v_n = v_(n-1) + a_n dt,
x_(n+1) = x_n + v_n dt, v_0 = 0. So it is of second order in itself, but follows the motion of a
piston that started at -a dt / 2, which is an error of first order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pytest

from liggghts_driver.studies import exact_contacts
from liggghts_driver.studies.exact_contacts import Contact

from .hertz_reference import effective_modulus
from .support import order, stepping

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .support import Outcome, Simulator, Tables

pytestmark = pytest.mark.engine

RADIUS, DENSITY, MODULUS, NU = 1.5e-3, 7000.0, 1e7, 0.25
MASS = DENSITY * 4.0 / 3.0 * math.pi * RADIUS**3
#: Hertz's k in F = k overlap^(3/2): sphere on plane. Between equal spheres it is k / sqrt(2).
MODULUS_EFFECTIVE = effective_modulus((MODULUS, NU), (MODULUS, NU))
STIFFNESS = 4.0 / 3.0 * MODULUS_EFFECTIVE * math.sqrt(RADIUS)
MATERIAL = {"density": DENSITY, "youngs_modulus": MODULUS, "poissons_ratio": NU}
STEPS = (3200, 6400, 12800)
FRAMES = 200


@pytest.mark.parametrize("fluid", [None, {"density": 1000.0, "viscosity": 1e-3}])
def test_free_piston(simulator: Simulator, fluid: Tables | None) -> None:
    """x = a t (t - dt) / 2, the leap-frog's own parabola; nothing else moves.

    With a fluid the engine runs in pieces, between which coefficients are refreshed.
    """
    acceleration = 2e-3
    scenes: list[Tables] = [
        {
            # So soft that the step would do if the piston leaned on the sphere, which it does not.
            "particles": {**MATERIAL, "youngs_modulus": MODULUS / 10.0},
            "spheres": [{"radius": RADIUS, "position": [0.05, 0.0, 0.0]}],
            "contact": {"restitution": 1.0},
            "box": {"low": [0.0, -0.005, -0.005], "high": [0.06, 0.005, 0.005], "walls": ["x+"]},
            "piston": {"acceleration": acceleration, "mass": 1.0},
            "drag": {"refresh": 2.0 / 20},
            **stepping(2.0 / steps, steps, 20),
            **({} if fluid is None else {"fluid": fluid}),
        }
        for steps in (2000, 4000, 8000)
    ]
    for outcome in simulator.run_all(scenes):
        times, step = outcome.series["time_s"].to_numpy(), outcome.case.time.step_s
        # Rounding of as many sums as steps.
        rounding = 2.0 * outcome.case.time.steps * np.finfo(float).eps
        exact = acceleration * times * (times - step) / 2.0
        assert outcome.series["piston_x_m"].to_numpy() == pytest.approx(
            exact, abs=rounding * exact[-1]
        )
        assert np.all(outcome.velocities_m_s == 0.0)


@dataclass(frozen=True)
class Row:
    """A row of touching spheres between the piston and the wall, all at rest.

    ``mass`` of the piston [kg], its free ``acceleration`` [m/s2].
    """

    spheres: int
    mass: float
    acceleration: float = 1.0
    restitution: float = 1.0

    @property
    def duration(self) -> float:
        """Three periods or so: the row is one spring, of `spheres` + 1 contacts in series."""
        stiffness = STIFFNESS / (2.0 + math.sqrt(2.0) ** (2.0 / 3.0) * (self.spheres - 1)) ** 1.5
        amplitude = (2.5 * self.mass * self.acceleration / stiffness) ** (2.0 / 3.0)
        return 8.0 * math.sqrt(amplitude / self.acceleration)

    def scene(self, steps: int, side: tuple[float, float] = (0.0, 0.0)) -> Tables:
        length = 2.0 * RADIUS * self.spheres
        return {
            "particles": MATERIAL,
            "spheres": [
                {"radius": RADIUS, "position": [RADIUS * (1.0 + 2.0 * n), *side]}
                for n in range(self.spheres)
            ],
            "contact": {"restitution": self.restitution},
            "box": {
                "low": [0.0, -0.002, -0.002],
                "high": [length, 0.002, 0.002],
                "walls": ["x+"],
            },
            "piston": {"acceleration": self.acceleration, "mass": self.mass},
            **stepping(self.duration / steps, steps, FRAMES),
        }

    def exact(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Places and then velocities of piston and spheres, ``(2 spheres + 2, times)``."""
        # The piston is damped as a wall is: with the sphere's mass as the effective one.
        plane = Contact(MASS, RADIUS, MODULUS_EFFECTIVE, self.restitution)
        pair = Contact(MASS / 2.0, RADIUS / 2.0, MODULUS_EFFECTIVE, self.restitution)
        force = self.mass * self.acceleration
        row = exact_contacts.Row(self.spheres, RADIUS, MASS, self.mass, force, plane, pair)
        return row.motion(times)


def period(times: NDArray[np.float64], places: NDArray[np.float64]) -> float:
    """From the first to the second turning point at the far end, through parabolas."""
    inner = places[1:-1]
    tops = 1 + np.flatnonzero((inner > places[:-2]) & (inner >= places[2:]))
    tops = tops[places[tops] > 0.8 * places.max()][:2]
    left, middle, right = places[tops - 1], places[tops], places[tops + 1]
    shift = 0.5 * (left - right) / (left - 2.0 * middle + right)
    return float(np.diff(times[tops] + shift * (times[1] - times[0]))[0])


ROWS = {
    "ten times as heavy": Row(1, 10.0 * MASS),
    "a hundred times as heavy": Row(1, 100.0 * MASS),
    "two spheres": Row(2, 30.0 * MASS),
    "damped": Row(1, 30.0 * MASS, restitution=0.6),
}


@pytest.mark.parametrize("row", ROWS.values(), ids=ROWS.keys())
def test_piston_on_a_spring(simulator: Simulator, row: Row) -> None:
    """Its motion, to and fro on spheres that repel it, and theirs."""
    outcomes = simulator.run_all([row.scene(steps) for steps in STEPS])
    errors = []
    exact = row.exact(outcomes[0].series["time_s"].to_numpy())  # the frames' times are the same
    travel = exact[0].max()
    for outcome in outcomes:
        piston = outcome.series["piston_x_m"].to_numpy()
        spheres = outcome.positions_m[:, :, 0].T
        wrong = max(
            np.abs(piston - exact[0]).max(), np.abs(spheres - exact[1 : row.spheres + 1]).max()
        )
        errors.append(wrong / travel)
        if row.restitution == 1.0:
            # What the piston's contact weighs on it is in the series, too.
            push = -STIFFNESS * np.maximum(RADIUS - (spheres[0] - piston), 0.0) ** 1.5
            assert outcome.series["piston_force_n"][1:].to_numpy() == pytest.approx(
                push[1:], abs=1e-9 * np.abs(push).max()
            )
        assert np.diff(piston).min() < 0.0 < travel  # it recedes
        assert piston.min() > -0.01 * travel  # but not beyond where it came from
    # 0.1: the late start is the larger part of the error, not all of it.
    assert order(STEPS, errors)[0] == pytest.approx(-1.0, abs=0.1)
    # The start is half a step late; over three periods that comes to less than three steps'
    # share of one.
    assert errors[-1] < 3.0 * 3.0 / STEPS[-1]


def test_period_and_amplitude_follow_the_mass(simulator: Simulator) -> None:
    """F = M a: the amplitude grows with M^(2/3), the period with M^(1/3) where M is far above m.

    The spring hardens: (2/5) k x^(5/2) = M a x, so x ~ M^(2/3), and T ~ sqrt(x / a).
    """
    factors = (10.0, 100.0, 1000.0)
    rows = [Row(1, factor * MASS) for factor in factors]
    measured, expected = [], []
    for row, outcome in zip(rows, simulator.run_all([r.scene(6400) for r in rows]), strict=True):
        times = outcome.series["time_s"].to_numpy()
        piston = outcome.series["piston_x_m"].to_numpy()
        exact = row.exact(times)[0]
        measured.append((period(times, piston), piston.max()))
        expected.append((period(times, exact), exact.max()))
    # 0.2 %: the step, and the parabolas through frames a fiftieth of a period apart.
    assert np.array(measured) == pytest.approx(np.array(expected), rel=2e-3)
    # 3 %: at ten times its mass the sphere's own inertia is still seen.
    assert order(factors, measured) == pytest.approx([1.0 / 3.0, 2.0 / 3.0], abs=0.03)


def test_where_a_sphere_touches_the_plate_does_not_matter(simulator: Simulator) -> None:
    """The plate is two triangles: on their common edge a sphere is not counted twice."""
    row = Row(1, 10.0 * MASS)
    # On the diagonal, beside it, and in the other triangle.
    sides = [(0.0, 0.0), (0.0003, 0.0), (-0.0003, 0.0001)]
    outcomes: list[Outcome] = simulator.run_all([row.scene(3200, side) for side in sides])
    first = outcomes[0].series["piston_x_m"]
    for outcome in outcomes[1:]:
        # Rounding, carried through three periods.
        assert outcome.series["piston_x_m"].to_numpy() == pytest.approx(
            first.to_numpy(), abs=1e-10 * first.max()
        )
