"""Spheres under a pressure gradient that goes to and fro in time, with and without drag.

Their equation of motion is solved apart from the package: in closed form, or by SciPy to ten digits
with Eq. 18 as the paper has it.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from small_scenes import case_of

from liggghts_driver.results.positions import read_frames
from liggghts_driver.studies.exact_falls import Immersed

from .falls import LAW
from .support import order, stepping
from .test_continuation import both, differences

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

    from .support import Outcome, Simulator, Tables

    Array = NDArray[np.float64]

#: Half a minute: long checks, so that every change is tested in a quarter of an hour.
pytestmark = [pytest.mark.engine, pytest.mark.validate]

PERIOD, DENSITY, ACCELERATION = 1.0, 2000.0, 0.04
RATE = 2.0 * math.pi / PERIOD
GRADIENT = ACCELERATION * DENSITY / 1.5  # Eq. 20 over the mass, the same for every radius
FRAMES, PERIODS = 30, 1.5
HALVINGS = (1, 2, 4)


@dataclass(frozen=True)
class Swung:
    """Spheres side by side in one fluid, from a twentieth of a period to two to relax in."""

    fluid_density: float
    viscosity: float = 1e-3

    @property
    def spheres(self) -> list[Immersed]:
        relaxations = PERIOD * np.geomspace(0.05, 2.0, 6)
        radii = np.sqrt(4.5 * relaxations * self.viscosity / DENSITY)  # of Stokes' law
        return [
            Immersed(radius, DENSITY, self.fluid_density, self.viscosity, LAW)
            for radius in radii.tolist()
        ]

    @property
    def quickest(self) -> float:
        """The shortest time in which anything changes: m / K at the most, or 1 / w."""
        fastest = ACCELERATION / RATE
        return min(
            1.0 / RATE, *(s.mass_kg * fastest / resistance(s, fastest) for s in self.spheres)
        )

    def scene(self, drag: Tables, step: float, steps: int) -> Tables:
        room = 3.0 * max(sphere.radius_m for sphere in self.spheres)
        return {
            "fluid": {"density": self.fluid_density, "viscosity": self.viscosity},
            **in_a_box([sphere.radius_m for sphere in self.spheres], room),
            "drag": drag,
            **stepping(step, steps, FRAMES),
        }

    def errors(self, outcome: Outcome) -> Array:
        """Of velocity and place, over the largest of each sphere: the larger, in any frame."""
        exact = np.array([swung(sphere)(outcome.times_s) for sphere in self.spheres])
        found = np.array([outcome.velocities_m_s[:, :, 0].T, outcome.positions_m[:, :, 0].T])
        wrong = np.abs(found - exact.swapaxes(0, 1)).max(axis=2) / np.abs(exact).max(axis=2).T
        largest: Array = wrong.max(axis=0)
        return largest


def in_a_box(radii: list[float], room: float) -> Tables:
    """Spheres at rest, each on a lane of its own; so soft that no contact bounds the step."""
    return {
        "particles": {"density": DENSITY, "youngs_modulus": 1.0, "poissons_ratio": 0.25},
        "spheres": [
            {"radius": radius, "position": [0.0, room * lane, 0.0]}
            for lane, radius in enumerate(radii)
        ],
        "pressure": {"gradient": GRADIENT, "period": PERIOD},
        "contact": {"restitution": 0.5},
        "box": {"low": [-room] * 3, "high": [room, room * len(radii), room]},
    }


def resistance(sphere: Immersed, speed: float) -> float:
    return sphere.drag_n(speed, sphere.branch_at(sphere.reynolds(speed)))


@functools.cache
def swung(sphere: Immersed) -> Callable[[Array], Array]:
    """Velocity and place, in time, of a sphere that starts at rest: drag is against its motion."""

    def change(time: float, state: Array) -> list[float]:
        speed = abs(float(state[0]))
        drag = math.copysign(resistance(sphere, speed), state[0]) / sphere.mass_kg
        return [ACCELERATION * math.cos(RATE * time) - drag, state[0]]

    solution = solve_ivp(
        change, (0.0, 1.01 * PERIODS * PERIOD), [0.0, 0.0], method="DOP853",
        rtol=1e-10, atol=1e-16, max_step=PERIOD / 100, dense_output=True,
    ).sol  # fmt: skip
    assert solution is not None
    return solution


@pytest.mark.parametrize("fluid", [{}, {"fluid": {"density": 1.0, "viscosity": 1.0}}], ids=len)
def test_without_drag_the_order_is_two(simulator: Simulator, fluid: Tables) -> None:
    """g cos(w t) from rest: x = (g / w^2)(1 - cos(w t)); the same at half the step with 1/4 of it.

    Velocity Verlet's own solution is that with w replaced by (2 / dt) sin(w dt / 2) in the factor.
    """
    steps = PERIOD / 100 / np.array(HALVINGS)
    bare = {**in_a_box([1e-3, 2e-3], 0.01), **fluid, "drag": {"scheme": "none"}}
    scenes = [
        {**bare, **stepping(float(step), round(PERIODS * PERIOD / step), FRAMES)} for step in steps
    ]
    wrong = []
    for step, outcome in zip(steps, simulator.run_all(scenes), strict=True):
        swing = 1.0 - np.cos(RATE * outcome.times_s)[:, None]
        places, largest = outcome.positions_m[:, :, 0], 2.0 * ACCELERATION / RATE**2
        wrong.append(np.abs(places - ACCELERATION / RATE**2 * swing).max(axis=0) / largest)
        own = 2.0 / step * math.sin(RATE * step / 2.0)
        # Rounding, in sums of as many terms as there are steps.
        rounding = len(HALVINGS) * PERIODS * PERIOD / step * np.finfo(float).eps
        expected = np.broadcast_to(ACCELERATION / own**2 * swing, places.shape)
        assert places == pytest.approx(expected, abs=largest * rounding)
    # The error is (w dt)^2 / 12; the next term is of fourth order, 1e-4 of the first.
    assert wrong[0] == pytest.approx((RATE * steps[0]) ** 2 / 12.0, rel=1e-3)
    assert order(steps, wrong) == pytest.approx(2.0, abs=1e-3)


def test_a_step_that_nobody_gave_resolves_the_period(simulator: Simulator) -> None:
    length = PERIODS * PERIOD
    tables = {**in_a_box([1e-3], 0.01), **stepping(length / FRAMES, FRAMES, FRAMES)}
    del tables["time"]["step"]
    outcome = simulator.run(tables)
    swing = 1.0 - np.cos(RATE * outcome.times_s)
    wrong = np.abs(outcome.positions_m[:, 0, 0] - ACCELERATION / RATE**2 * swing).max()
    # Of a hundredth of the period (w dt)^2 / 12, as above, and 1 % for the next term.
    assert wrong < 1.01 * (RATE * PERIOD / 100) ** 2 / 12.0 * 2.0 * ACCELERATION / RATE**2


def plans(spheres: Swung, scheme: str, *, kept: bool) -> tuple[Array, list[Tables]]:
    """Runs with the step, or with the interval for which things are kept, halved twice."""
    length = PERIODS * PERIOD / FRAMES
    parts = math.ceil(length / (spheres.quickest / (10 if kept or scheme == "implicit" else 40)))
    each = [parts * halving for halving in HALVINGS]
    # The step must not be seen beside the interval: its own error is of second order, too.
    finest = 16 * each[-1] if kept else 0
    scenes = []
    for number in each:
        drag = {"scheme": scheme, **({"refresh": length / number} if kept else {})}
        steps = finest or number
        scenes.append(spheres.scene(drag, length / steps, FRAMES * steps))
    return length / np.array(each), scenes


@pytest.mark.parametrize(
    ("scheme", "fluid_density", "kept", "expected"),
    [
        ("exact", 0.1, False, 1.0),
        ("implicit", 0.1, False, 2.0),
        ("held", 0.1, True, 2.0),
        ("exact", 1000.0, False, 1.0),
        ("implicit", 1000.0, True, 2.0),
        ("held", 1000.0, True, 2.0),
    ],
    ids=["exact", "implicit", "held", "exact-re", "implicit-re", "held-re"],
)
def test_order_with_drag(
    simulator: Simulator, scheme: str, fluid_density: float, kept: bool, expected: float
) -> None:
    """Below Re = 1, where K is constant, and up to Re = 20.

    The exact scheme's drag is half a step old; the implicit one is Crank and Nicolson's, with the
    gradient of each step, and keeps nothing where K is constant.
    """
    spheres = Swung(fluid_density)
    halved, scenes = plans(spheres, scheme, kept=kept)
    outcomes = simulator.run_all(scenes)
    wrong = np.array([spheres.errors(outcome) for outcome in outcomes])
    reached = max(float(outcome.series["largest_reynolds"].max()) for outcome in outcomes)
    assert (reached < 0.01) if fluid_density < 1.0 else (10.0 < reached < 30.0)
    assert np.all(wrong[0] < (halved[0] / spheres.quickest) ** expected)
    # 0.15: the next term of the error, at most a tenth of the first at these intervals, and where
    # it has the opposite sign the error falls faster: so it may at the kink of Eq. 18 at Re = 1.
    exponents = order(halved, wrong)
    assert exponents.min() > expected - 0.15
    assert np.median(exponents) == pytest.approx(expected, abs=0.1)


@pytest.mark.parametrize("fluid_density", [0.1, 1000.0])
@pytest.mark.parametrize("scheme", ["held", "implicit"])
def test_the_default_interval_keeps_its_tolerance(
    simulator: Simulator, scheme: str, fluid_density: float
) -> None:
    """Whichever is the shorter here for a sphere, its relaxation or the period."""
    tolerance, spheres = 0.005, Swung(fluid_density)
    steps = FRAMES * 100 * math.ceil(PERIODS * PERIOD / FRAMES / spheres.quickest)
    drag = {"scheme": scheme, "tolerance": tolerance}
    step = PERIODS * PERIOD / steps
    outcome = simulator.run(spheres.scene(drag, step, steps))
    kept = outcome.case.time.refresh_every
    assert kept > 5 or (scheme == "implicit" and fluid_density < 1.0)
    assert spheres.errors(outcome).max() < tolerance


@pytest.mark.parametrize("scheme", ["none", "exact", "held", "implicit"])
def test_a_run_in_parts_goes_on_in_phase(tmp_path: Path, scheme: str) -> None:
    """Through three checkpoints, away from each other and from the ends of a half period."""
    spheres = Swung(1000.0)
    refresh = {"refresh": PERIOD / 200} if scheme in ("held", "implicit") else {}
    case = case_of(spheres.scene({"scheme": scheme, **refresh}, PERIOD / 1000, 1500))
    whole, parts = both(case, tmp_path, [0.21, 0.52, 0.77])
    # Nothing multiplies errors here: rounding, in sums of as many terms as there are steps.
    rounding = 1500 * np.finfo(float).eps
    assert differences(whole, parts).to_numpy().max() < rounding
    one, other = read_frames(whole), read_frames(parts)
    largest = np.abs(one.positions_m[:, :, 0]).max()
    assert other.positions_m[:, :, 0] == pytest.approx(
        one.positions_m[:, :, 0], abs=largest * rounding
    )
