"""A piston under a constant force: free, and against a sphere that is a spring to it."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

from liggghts_driver.physics.contact import Body, effective_modulus_pa
from liggghts_driver.physics.spheres import sphere_volume_m3
from liggghts_driver.scene.read import make_scene
from liggghts_driver.studies.exact import Expected, Knob, Problem, Trial
from liggghts_driver.studies.exact_contacts import Contact, Row

if TYPE_CHECKING:
    from collections.abc import Mapping

    from liggghts_driver.scene.model import Scene
    from liggghts_driver.studies.exact import Moved

RADIUS_M, DENSITY_KG_M3, MODULUS_PA, POISSON = 1.5e-3, 7000.0, 1e7, 0.25
#: So soft that the longest step would do if the free piston touched anything.
_SOFT_PA = 1e6
MASS_KG = DENSITY_KG_M3 * sphere_volume_m3(RADIUS_M)
#: Of the free piston, and how long it is watched.
_FREE_M_S2, _FREE_S = 2e-2, 0.2
_FREE_STEPS = (1600, 800, 400, 200)
#: Of the piston on a spring: many times as heavy as the sphere, so that it goes to and fro slowly.
_PUSH_M_S2, _HEAVIER = 1.0, 30.0
_SPRING_STEPS = (12800, 6400, 3200, 1600)
_SAMPLES = 50

_LATE = "the engine's piston starts half a step late"


def piston_problems(every: int) -> list[Problem]:
    """Both, their costs in steps."""
    spring = _row()
    lasts = _spring_s()
    free = [
        Trial(1.0 / n, _scene(_free(), _FREE_S, n, _SOFT_PA), _free_errors, n)
        for n in _FREE_STEPS[::every]
    ]
    sprung = [
        Trial(1.0 / n, _scene(_sprung(), lasts, n), partial(_row_errors, spring), n)
        for n in _SPRING_STEPS[::every]
    ]
    return [
        Problem(
            "piston",
            "piston",
            "steps per run",
            (
                Knob("free", "step / run", tuple(free), (Expected("place", 1.0, 0.01, _LATE),)),
                Knob(
                    "on a sphere",
                    "step / run",
                    tuple(sprung),
                    (Expected("place", 1.0, 0.1, _LATE),),
                ),
            ),
        )
    ]


def _free() -> dict[str, Any]:
    return {
        "spheres": [{"radius": RADIUS_M, "position": [0.05, 0.0, 0.0]}],
        "box": {"low": [0.0, -0.005, -0.005], "high": [0.06, 0.005, 0.005], "walls": ["x+"]},
        "piston": {"acceleration": _FREE_M_S2, "mass": 1.0},
    }


def _sprung() -> dict[str, Any]:
    length = 2.0 * RADIUS_M
    return {
        "spheres": [{"radius": RADIUS_M, "position": [RADIUS_M, 0.0, 0.0]}],
        "box": {"low": [0.0, -0.002, -0.002], "high": [length, 0.002, 0.002], "walls": ["x+"]},
        "piston": {"acceleration": _PUSH_M_S2, "mass": _HEAVIER * MASS_KG},
    }


def _scene(
    tables: Mapping[str, Any], duration_s: float, steps: int, modulus_pa: float = MODULUS_PA
) -> Scene:
    return make_scene(
        {
            "title": "a piston",
            "particles": {
                "density": DENSITY_KG_M3,
                "youngs_modulus": modulus_pa,
                "poissons_ratio": POISSON,
            },
            "contact": {"restitution": 1.0},
            **tables,
            "time": {"duration": duration_s, "step": duration_s / steps, "step_fraction": 1.0},
            "output": {"samples": _SAMPLES, "frames": 1, "images": 0},
        }
    )


def _row() -> Row:
    """A sphere between the piston and the wall."""
    body = Body(RADIUS_M, MASS_KG, MODULUS_PA, POISSON)
    modulus = effective_modulus_pa(body, body)
    plane = Contact(MASS_KG, RADIUS_M, modulus, 1.0)
    pair = Contact(MASS_KG / 2.0, RADIUS_M / 2.0, modulus, 1.0)
    heavy = _HEAVIER * MASS_KG
    return Row(1, RADIUS_M, MASS_KG, heavy, heavy * _PUSH_M_S2, plane, pair)


def _spring_s() -> float:
    """Three periods or so: two contacts in series, which force and inertia compress."""
    row = _row()
    stiffness = 4.0 / 3.0 * row.plane.modulus_pa * math.sqrt(RADIUS_M) / 2.0**1.5
    amplitude = (2.5 * row.force_n / stiffness) ** (2.0 / 3.0)
    return 8.0 * math.sqrt(amplitude / _PUSH_M_S2)


def _free_errors(run: Moved) -> dict[str, float]:
    """Of a t^2 / 2, at the end."""
    last = run.series.iloc[-1]
    should = _FREE_M_S2 * last["time_s"] ** 2 / 2.0
    return {"place": abs(float(last["piston_x_m"]) / should - 1.0)}


def _row_errors(row: Row, run: Moved) -> dict[str, float]:
    """The largest at any sample, over the largest way."""
    series = run.series
    exact = row.motion(series["time_s"].to_numpy())[0]
    wrong = abs(series["piston_x_m"].to_numpy() - exact).max()
    return {"place": float(wrong / exact.max())}
