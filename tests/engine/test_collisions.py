"""Collisions of two bodies: restitution, duration, momentum, and the order of the scheme.

The scheme is velocity Verlet, which takes the damping force at a velocity half a step old: first
order as soon as there is damping. Without it the scheme is of second order and conserves its own
energy; all that is left of the error comes from the first and the last step of the contact, where
the force begins as overlap^(3/2), and such a corner costs step^(5/2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pytest

from liggghts_driver.physics.contact import Body, contact_duration_s, elastic_duration_s

from .hertz_reference import Contact, effective_modulus
from .support import order, stepping

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .support import Outcome, Simulator, Tables

pytestmark = pytest.mark.engine

DENSITY = 7000.0
RADIUS = 1.5e-3
SPEED = 0.02
PARTICLE_NU, GRAIN_NU, WALL_NU = 0.2, 0.4, 0.3
#: Largest |error of e| x contact duration / step over all phases of the grid and all e, as the
#: study of the order below finds it (0.31, at e = 0.3); a little room is added.
FIRST_ORDER = 0.35


def mass(radius: float) -> float:
    return DENSITY * 4.0 / 3.0 * math.pi * radius**3


@dataclass(frozen=True)
class Encounter:
    """A sphere that flies at another body along ``axis``.

    The other is a sphere of radius ``other`` that flies towards it with the opposite momentum, a
    fixed grain of that radius, or the wall below (``other = inf``).
    """

    other: float
    fixed: bool
    speed: float
    axis: NDArray[np.float64]

    def body(self, modulus: float) -> Body:
        return Body(RADIUS, mass(RADIUS), modulus, PARTICLE_NU)

    def partner(self, modulus: float) -> Body:
        if math.isinf(self.other):
            return Body(math.inf, math.inf, modulus / 2.0, WALL_NU)
        if self.fixed:
            return Body(self.other, math.inf, modulus / 3.0, GRAIN_NU)
        return Body(self.other, mass(self.other), modulus, PARTICLE_NU)

    def contact(self, modulus: float, restitution: float) -> Contact:
        a, b = self.body(modulus), self.partner(modulus)
        return Contact(
            mass=1.0 / (1.0 / a.mass_kg + 1.0 / b.mass_kg),
            radius=1.0 / (1.0 / a.radius_m + 1.0 / b.radius_m),
            modulus=effective_modulus(
                (a.youngs_modulus_pa, a.poissons_ratio), (b.youngs_modulus_pa, b.poissons_ratio)
            ),
            restitution=restitution,
        )

    @property
    def gap(self) -> float:
        """Free way before the contact: a fifth of a radius for the fastest."""
        return 0.002 * RADIUS * self.speed / SPEED


def encounters() -> list[Encounter]:
    """Size ratios 1, 3 and 10, free and fixed, and the wall; every direction, several speeds."""
    rng = np.random.default_rng(7)
    found = []
    for number, (ratio, fixed) in enumerate(
        [(1, False), (3, False), (10, False), (1, True), (3, True), (10, True)]
    ):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        found.append(Encounter(ratio * RADIUS, fixed, SPEED * (1.0 + 0.2 * number), axis))
    return [*found, Encounter(math.inf, True, SPEED, np.array([0.0, 0.0, -1.0]))]


def scene(modulus: float, restitution: float, step_s: float, steps: int) -> Tables:
    """Every encounter in one box, each in a place of its own."""
    spacing = 30.0 * RADIUS
    spheres = []
    met = encounters()
    for number, meeting in enumerate(met):
        centre = np.array([number * spacing, 0.0, 0.0])
        if math.isinf(meeting.other):
            height = -15.0 * RADIUS + RADIUS + meeting.gap
            spheres.append(sphere(RADIUS, [centre[0], 0.0, height], meeting.speed * meeting.axis))
            continue
        other_speed = 0.0
        if not meeting.fixed:
            other_speed = meeting.speed / (1.0 + mass(meeting.other) / mass(RADIUS))
        distance = RADIUS + meeting.other + meeting.gap
        first = (meeting.speed - other_speed) * meeting.axis
        spheres.append(sphere(RADIUS, centre - distance * meeting.axis, first))
        second = -other_speed * meeting.axis
        spheres.append(sphere(meeting.other, centre, second, fixed=meeting.fixed))
    return {
        "particles": material(modulus, PARTICLE_NU) | {"density": DENSITY},
        "grains": material(modulus / 3.0, GRAIN_NU),
        "walls": material(modulus / 2.0, WALL_NU),
        "spheres": spheres,
        "contact": {"restitution": restitution},
        "box": {
            "low": [-0.5 * spacing, -0.5 * spacing, -0.5 * spacing],
            "high": [(len(met) - 0.5) * spacing, 0.5 * spacing, 0.5 * spacing],
            "walls": ["z-"],
        },
        **stepping(step_s, steps),
    }


def material(modulus: float, ratio: float) -> Tables:
    return {"youngs_modulus": modulus, "poissons_ratio": ratio}


def sphere(
    radius: float,
    position: NDArray[np.float64] | list[float],
    velocity: NDArray[np.float64],
    *,
    fixed: bool = False,
) -> Tables:
    place = {"radius": radius, "position": [float(x) for x in position]}
    if fixed:
        return place | {"kind": "grain"}
    return place | {"velocity": [float(v) for v in velocity]}


def partings(outcome: Outcome) -> list[tuple[float, float]]:
    """Speed of parting and duration of each encounter, both from the last frame alone.

    The flight before and after the contact is straight and uniform, so the instants of touching
    follow from the gap at the start and the gap in the last frame.
    """
    last_x, last_v = outcome.positions_m[-1], outcome.velocities_m_s[-1]
    found = []
    row = 0
    for number, meeting in enumerate(encounters()):
        if math.isinf(meeting.other):
            gap = last_x[row, 2] + 15.0 * RADIUS - RADIUS
            parting = last_v[row, 2]
        else:
            centre, velocity = np.array([number * 30.0 * RADIUS, 0.0, 0.0]), np.zeros(3)
            if not meeting.fixed:
                centre, velocity = last_x[row + 1], last_v[row + 1]
            apart = centre - last_x[row]
            gap = float(np.linalg.norm(apart)) - RADIUS - meeting.other
            parting = float((velocity - last_v[row]) @ meeting.axis)
        row += 1 if meeting.fixed else 2
        ended = outcome.times_s[-1] - gap / parting
        found.append((float(parting), float(ended - meeting.gap / meeting.speed)))
    return found


@pytest.fixture(scope="module")
def collisions(simulator: Simulator) -> dict[tuple[float, float], Outcome]:
    """All encounters, the step a 1000th of the shortest.

    Every modulus with three restitutions, every restitution with two moduli.
    """
    moduli, restitutions = (1e6, 1e7, 1e8, 1e9), (0.1, 0.3, 0.5, 0.7, 0.9, 1.0)
    cases = [
        (modulus, restitution)
        for row, modulus in enumerate(moduli)
        for column, restitution in enumerate(restitutions)
        if (row + column) % 2 == 0
    ]
    scenes = []
    for modulus, restitution in cases:
        durations = [
            elastic_duration_s(met.body(modulus), met.partner(modulus), met.speed)
            for met in encounters()
        ]
        # The slowest damped contact lasts 1.5 elastic ones (e = 0.1), the way to it is shorter.
        steps = 10 * math.ceil(250.0 * max(durations) / min(durations))
        scenes.append(scene(modulus, restitution, min(durations) / 1000.0, steps))
    return dict(zip(cases, simulator.run_all(scenes), strict=True))


def test_restitution(collisions: dict[tuple[float, float], Outcome]) -> None:
    """The speed of parting is e times that of approach, whatever meets whatever.

    A fixed grain and a wall are infinitely heavy: m* is then the particle's mass, and the
    particle leaves with e times its own speed.
    """
    for (modulus, restitution), outcome in collisions.items():
        step = outcome.case.time.step_s
        for meeting, (parting, _) in zip(encounters(), partings(outcome), strict=True):
            lasts = elastic_duration_s(
                meeting.body(modulus), meeting.partner(modulus), meeting.speed
            )
            # Damped: first order. Elastic: 0.8 (step / duration)^(5/2), as the study below finds.
            allowed = FIRST_ORDER * step / lasts if restitution < 1 else (step / lasts) ** 2.5
            assert parting / meeting.speed == pytest.approx(restitution, abs=allowed), meeting


def test_duration(collisions: dict[tuple[float, float], Outcome]) -> None:
    """Durations: the closed form for elastic contacts, the damped equation of motion for others."""
    for (modulus, restitution), outcome in collisions.items():
        step = outcome.case.time.step_s
        for meeting, (_, duration) in zip(encounters(), partings(outcome), strict=True):
            bodies = meeting.body(modulus), meeting.partner(modulus)
            elastic = elastic_duration_s(*bodies, meeting.speed)
            if restitution == 1.0:
                # 1e-6: the closed form's factor 2.943275 is rounded there.
                assert duration == pytest.approx(elastic, rel=1e-6), meeting
                # 0.2 %: the paper rounds 2.8683 to 2.87, its factor 0.06 % too long.
                assert duration == pytest.approx(
                    contact_duration_s(*bodies, meeting.speed), rel=2e-3
                )
            contact = meeting.contact(modulus, restitution)
            exact = contact.collide(meeting.speed, np.array([0.0])).duration
            # The damped contact is too short by up to 0.35 of a step (at e = 0.3).
            allowed = 1e-6 if restitution == 1.0 else 0.4 * step / elastic
            assert duration == pytest.approx(exact, rel=allowed), meeting


def test_momentum(collisions: dict[tuple[float, float], Outcome]) -> None:
    """Two free spheres exchange momentum and nothing else: only rounding is left."""
    for outcome in collisions.values():
        # Each step rounds each of the two momenta once, to half a unit in the last place.
        rounding = outcome.case.time.steps * np.finfo(float).eps
        row = 0
        for meeting in encounters():
            if not meeting.fixed:
                masses = np.array([mass(RADIUS), mass(meeting.other)])
                before = masses @ outcome.velocities_m_s[0, row : row + 2]
                after = masses @ outcome.velocities_m_s[-1, row : row + 2]
                scale = masses[0] * meeting.speed
                assert np.abs(after - before).max() <= rounding * scale
            row += 1 if meeting.fixed else 2


FRACTIONS = np.array([1 / 40, 1 / 80, 1 / 160, 1 / 320, 1 / 640])
PHASES = 48


def phases(restitution: float, fraction: float) -> Tables:
    """Equal pairs that touch at all phases of the step: a step is cut in 48."""
    body = Body(RADIUS, mass(RADIUS), 1e7, PARTICLE_NU)
    lasts = elastic_duration_s(body, body, 2.0 * SPEED)
    step = fraction * lasts
    gaps = (2.0 + (np.arange(PHASES) + 0.5) / PHASES) * 2.0 * SPEED * step
    lanes = 4.0 * RADIUS * np.arange(PHASES)
    spheres = []
    for gap, lane in zip(gaps, lanes, strict=True):
        for side in (-1.0, 1.0):
            place, velocity = [side * (RADIUS + gap / 2.0), lane, 0.0], np.array([-side, 0.0, 0.0])
            spheres.append(sphere(RADIUS, place, SPEED * velocity))
    steps = 10 * math.ceil((1.6 / fraction + 3.0) / 10.0)
    return {
        "particles": material(1e7, PARTICLE_NU) | {"density": DENSITY},
        "spheres": spheres,
        "contact": {"restitution": restitution},
        "box": {"low": [-0.01, -0.01, -0.01], "high": [0.01, float(lanes[-1]) + 0.01, 0.01]},
        **stepping(step, steps),
    }


def restitution_errors(outcomes: list[Outcome], restitution: float) -> NDArray[np.float64]:
    """``(steps, phases)``."""
    last = np.array([outcome.velocities_m_s[-1, :, 0] for outcome in outcomes])
    errors: NDArray[np.float64] = (last[:, 1::2] - last[:, ::2]) / (2.0 * SPEED) - restitution
    return errors


@pytest.mark.parametrize("restitution", [0.1, 0.3, 0.5, 0.7])
def test_damped_restitution_is_of_first_order(simulator: Simulator, restitution: float) -> None:
    outcomes = simulator.run_all([phases(restitution, fraction) for fraction in FRACTIONS])
    errors = restitution_errors(outcomes, restitution)
    # The mean over the phases; 0.1 is what the next term, step^(5/4), does to a fit over a
    # sixteenfold range.
    assert order(FRACTIONS, np.abs(errors.mean(axis=1)))[0] == pytest.approx(1.0, abs=0.1)
    assert np.abs(errors / FRACTIONS[:, None]).max() < FIRST_ORDER


def test_elastic_restitution_is_of_order_five_halves(simulator: Simulator) -> None:
    outcomes = simulator.run_all([phases(1.0, fraction) for fraction in FRACTIONS])
    errors = restitution_errors(outcomes, 1.0)
    rms = np.sqrt((errors**2).mean(axis=1))
    # 0.05: the finest error, 7e-8, still stands far above rounding.
    assert order(FRACTIONS, rms)[0] == pytest.approx(2.5, abs=0.05)
    assert np.abs(errors / FRACTIONS[:, None] ** 2.5).max() < 1.0


def test_overlap_in_time(simulator: Simulator) -> None:
    """The overlap through a damped collision, frame by frame."""
    tables = phases(0.3, 1 / 640)
    tables["spheres"] = tables["spheres"][:2]
    steps = 1200
    tables |= stepping(tables["time"]["step"], steps, frames=400)
    outcome = simulator.run(tables)
    x = outcome.positions_m[:, :, 0]
    contact = Contact(
        mass(RADIUS) / 2.0, RADIUS / 2.0, effective_modulus((1e7, 0.2), (1e7, 0.2)), 0.3
    )
    touch = (x[0, 1] - x[0, 0] - 2.0 * RADIUS) / (2.0 * SPEED)
    exact = contact.collide(2.0 * SPEED, outcome.times_s - touch).overlaps
    overlaps = np.maximum(2.0 * RADIUS - (x[:, 1] - x[:, 0]), 0.0)
    # First order: at most a step's way at the speed of approach.
    assert np.abs(overlaps - exact).max() < 2.0 * SPEED * outcome.case.time.step_s
    assert exact.max() > 100.0 * 2.0 * SPEED * outcome.case.time.step_s
