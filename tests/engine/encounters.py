"""Seven encounters of two bodies in one box: spheres of all sizes, fixed grains, a wall."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.physics.contact import Body
from liggghts_driver.studies.exact_contacts import Contact

from .hertz_reference import effective_modulus
from .support import stepping

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .support import Outcome, Tables

DENSITY = 7000.0
RADIUS = 1.5e-3
SPEED = 0.02
PARTICLE_NU, GRAIN_NU, WALL_NU = 0.2, 0.4, 0.3
#: Largest |error of e| x contact duration / step over all phases of the grid and all e, as
#: test_collision_order finds it (0.31, at e = 0.3); a little room is added.
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
            mass_kg=1.0 / (1.0 / a.mass_kg + 1.0 / b.mass_kg),
            radius_m=1.0 / (1.0 / a.radius_m + 1.0 / b.radius_m),
            modulus_pa=effective_modulus(
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
