"""Collisions of equal spheres, in pairs that touch at all phases of the engine's step.

A pair's error depends on where in a step the contact begins. In a flow that is left to chance, so
a step is cut into as many phases as there are pairs, and errors are means over them.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from liggghts_driver.physics.contact import (
    Body,
    effective_mass_kg,
    effective_modulus_pa,
    effective_radius_m,
    elastic_duration_s,
)
from liggghts_driver.physics.spheres import sphere_volume_m3
from liggghts_driver.scene.read import make_scene
from liggghts_driver.studies.exact import Expected, Knob, Problem, Trial
from liggghts_driver.studies.exact_contacts import Contact

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from liggghts_driver.scene.model import Scene
    from liggghts_driver.studies.exact import Moved

RADIUS_M, DENSITY_KG_M3, MODULUS_PA, POISSON = 1.5e-3, 7000.0, 1e7, 0.2
MASS_KG = DENSITY_KG_M3 * sphere_volume_m3(RADIUS_M)
#: Of one sphere towards the other, and of both.
SPEED_M_S, APPROACH_M_S = 0.02, 0.04
DAMPED = 0.5
#: Shares of a contact that a step lasts, the finest first.
FRACTIONS = (1 / 320, 1 / 160, 1 / 80, 1 / 40, 1 / 20, 1 / 10)
SCALES = (1.0, 0.1, 0.01, 0.001)
#: Of a softened contact: fine enough that the frames see its deepest instant.
_FRACTION = 1 / 80
#: A run lasts two elastic contacts: a damped one of 0.5 lasts 1.2.
_CONTACTS, _FRAMES = 2, 40


def collision_problems(pairs: int, every: int) -> list[Problem]:
    """Damped, elastic, and softer ones.

    Parameters
    ----------
    pairs
        In a scene.
    every
        Which values of a knob are taken: 1 all, 2 every second, the finest first.
    """
    steps = FRACTIONS[::every]
    return [
        Problem(
            "damped",
            f"collision, restitution {DAMPED:g}",
            "steps per contact",
            (Knob("", "step / contact", _trials(steps, DAMPED, pairs), _DAMPED),),
        ),
        Problem(
            "elastic",
            "collision, elastic",
            "steps per contact",
            (Knob("", "step / contact", _trials(steps, 1.0, pairs), _ELASTIC),),
        ),
        Problem(
            "softer",
            "softer contacts",
            "steps per stiff contact",
            (Knob("", "stiffness scale", _softened(SCALES[::every], pairs), _SOFTER),),
        ),
    ]


_OLD = "the damping force is that of a velocity half a step old"
_CORNER = "a contact begins and ends within a step, and its force with a corner, overlap^(3/2)"
_NEARBY = "the scheme conserves an energy that differs from the true one by step^2"
_HERTZ = "m v^2 / 2 = (8/15) E sqrt(r) overlap^(5/2)"
_TSUJI = "Tsuji's damping makes it one number for all stiffnesses; the step's error is left"
# 0.1: the next terms, of powers a quarter to a half higher, over a range from 10 to 320 steps.
_DAMPED = (
    Expected("restitution", 1.0, 0.1, _OLD),
    Expected("duration", 1.0, 0.1, _OLD),
    Expected("kinetic energy", 1.0, 0.1, _OLD),
)
# 0.05: here the next term of a duration is of half an order more, and small.
_ELASTIC = (
    Expected("restitution", 2.5, 0.1, _CORNER),
    Expected("duration", 2.0, 0.05, _NEARBY),
    Expected("energy in contact", 2.0, 0.05, _NEARBY),
)
# 0.01: exact laws, and all runs see their contacts at the same instants; only rounding is left.
_SOFTER = (
    Expected("overlap / radius", -0.4, 0.01, _HERTZ),
    Expected("contact time", -0.4, 0.01, _HERTZ + ", and a contact lasts 2.94 overlap / v"),
    Expected("restitution", 0.0, 0.01, _TSUJI),
)


def contact(restitution: float, scale: float = 1.0) -> Contact:
    """What the engine should make of a pair."""
    body = _body(scale)
    return Contact(
        effective_mass_kg(body, body),
        effective_radius_m(body, body),
        effective_modulus_pa(body, body),
        restitution,
    )


def collision_scene(restitution: float, fraction: float, scale: float, pairs: int) -> Scene:
    """Pairs that touch from the third step on, each a little later than the one before.

    Parameters
    ----------
    restitution
        Of all of them.
    fraction
        Length of a step over that of an elastic contact.
    scale
        Factor on the stiffness.
    pairs
        Their number.
    """
    step_s = fraction * contact_time_s(scale)
    gaps = (2.0 + (np.arange(pairs) + 0.5) / pairs) * APPROACH_M_S * step_s
    lanes = 4.0 * RADIUS_M * np.arange(pairs)
    steps = round(_CONTACTS / fraction)
    frames = min(steps, _FRAMES)
    room = 4.0 * RADIUS_M
    return make_scene(
        {
            "title": "two spheres meet",
            "particles": {
                "density": DENSITY_KG_M3,
                "youngs_modulus": MODULUS_PA,
                "poissons_ratio": POISSON,
            },
            "spheres": [
                _sphere(side, gap, lane)
                for gap, lane in zip(gaps.tolist(), lanes.tolist(), strict=True)
                for side in (-1.0, 1.0)
            ],
            "contact": {"restitution": restitution, "stiffness_scale": scale},
            "box": {"low": [-room] * 3, "high": [room, float(lanes[-1]) + room, room]},
            "time": {"duration": step_s * steps, "step": step_s, "step_fraction": 1.0},
            "output": {"samples": frames, "frames": frames, "images": 0},
        }
    )


def contact_time_s(scale: float = 1.0) -> float:
    """How long an elastic contact lasts."""
    return elastic_duration_s(_body(scale), _body(scale), APPROACH_M_S)


def collision_errors(restitution: float, scale: float, run: Moved) -> dict[str, float]:
    """Errors of what pairs do, over what they should; the mean over the phases of a step.

    The flight before and after is straight and uniform, so the instants of touching and parting
    follow from the gaps in the first and last frame. The error of an elastic restitution has
    either sign, and its root mean square is taken. Softness is an error by itself: how deep a
    contact is, and how far a sphere could have gone while it lasts, both over the radius.
    """
    exact = contact(restitution, scale)
    should = exact.collide(APPROACH_M_S, np.zeros(1))
    x, v = run.positions_m[:, :, 0], run.velocities_m_s[:, :, 0]
    gaps, parting = x[:, 1::2] - x[:, ::2] - 2.0 * RADIUS_M, v[-1, 1::2] - v[-1, ::2]
    lasted = run.times_s[-1] - gaps[-1] / parting - gaps[0] / APPROACH_M_S
    wrong = parting / APPROACH_M_S - restitution
    energies = _energies(exact, gaps, v)
    return {
        "restitution": abs(wrong.mean()) if restitution < 1.0 else _rms(wrong),
        "duration": abs(lasted.mean() / should.duration_s - 1.0),
        "kinetic energy": abs((energies[-1] / energies[0]).mean() - restitution**2),
        "energy in contact": _rms(np.abs(energies / energies[0] - 1.0).max(axis=0)),
        "overlap / radius": float((-gaps.min(axis=0)).mean() / RADIUS_M),
        "contact time": float(lasted.mean()) * APPROACH_M_S / RADIUS_M,
    }


def _energies(exact: Contact, gaps_m: NDArray[np.float64], v: NDArray[np.float64]) -> Any:
    """Kinetic and elastic energy of each pair ``(frames, pairs)``."""
    kinetic = 0.5 * MASS_KG * (v[:, ::2] ** 2 + v[:, 1::2] ** 2)
    return kinetic + exact.elastic_energy_j(-gaps_m)


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt((values**2).mean()))


def _trials(fractions: Sequence[float], restitution: float, pairs: int) -> tuple[Trial, ...]:
    return tuple(
        Trial(
            fraction,
            collision_scene(restitution, fraction, 1.0, pairs),
            partial(collision_errors, restitution, 1.0),
            1.0 / fraction,
        )
        for fraction in fractions
    )


def _softened(scales: Sequence[float], pairs: int) -> tuple[Trial, ...]:
    return tuple(
        Trial(
            scale,
            collision_scene(DAMPED, _FRACTION, scale, pairs),
            partial(collision_errors, DAMPED, scale),
            contact_time_s() / contact_time_s(scale) / _FRACTION,
        )
        for scale in scales
    )


def _body(scale: float) -> Body:
    return Body(RADIUS_M, MASS_KG, MODULUS_PA * scale, POISSON)


def _sphere(side: float, gap_m: float, lane_m: float) -> dict[str, Any]:
    return {
        "radius": RADIUS_M,
        "position": [side * (RADIUS_M + gap_m / 2.0), lane_m, 0.0],
        "velocity": [-side * SPEED_M_S, 0.0, 0.0],
    }
