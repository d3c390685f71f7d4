"""Spheres in a fluid at rest, each on a lane of its own: launched, or pushed by pressure.

The exact scheme is turned by its step, the held and the implicit one by the interval for which they
keep what they keep, in steps so short that these are not seen beside it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from liggghts_driver.physics.drag import pressure_force_n
from liggghts_driver.scene.read import make_scene
from liggghts_driver.studies.exact import CORE_TIME, Expected, Knob, Problem, Trial
from liggghts_driver.studies.exact_falls import Fall, Immersed, Launch

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from liggghts_driver.scene.model import Scene
    from liggghts_driver.studies.exact import Moved

# As dense as the fluid, a launched sphere goes but a few radii in a relaxation.
RADIUS_M, DENSITY_KG_M3, FLUID_KG_M3 = 1e-3, 1000.0, 1000.0
WATER, SYRUP = 1e-3, 1.0  # Pa s
#: Reynolds numbers of launches, all within one branch of Eq. 18 as long as a run lasts.
_LAUNCHED = (20.0, 200.0)
#: The Reynolds number at which the middle one of pushed spheres ends; radii on both sides of it.
_FINAL, _SPREAD, _SIZES = 50.0, 1.2, 10
#: Below 1: pushed to it, and launched at these.
_SLOW, _CREEPING = 0.1, (0.05, 0.1)
#: Steps for a relaxation, where the step is turned; the finest first.
_STEPS = (160, 80, 40, 20)
_SLOW_STEPS = (80, 40, 20, 10)
#: Where the interval is turned: steps for a relaxation, and steps for an interval.
_FINE, _KEPT = 1280, (8, 16, 32, 64)
_RELAXATIONS, _FRAMES = 4, 20
_QUANTITIES = ("velocity", "place")

_LATE = "the drag is that of a velocity half a step old"
_MIDDLE = "what is kept for an interval is taken at its middle"
_CRANK = "the implicit step is that of Crank and Nicolson"
_MISSED = "the engine's implicit drag begins after the first half step, which a launch feels"


def drag_problems(spheres: int, every: int) -> list[Problem]:
    """Launches and free flights above Re = 1, and both below it, where only the step counts.

    Parameters
    ----------
    spheres
        In a scene whose core time is measured.
    every
        Which values of a knob are taken: 1 all, 2 every second, the finest first.
    """
    launches = _Launches(WATER, _LAUNCHED, spheres)
    flights = _Flights(WATER, _FINAL, spheres)
    return [
        Problem(
            "launch",
            "launched sphere slows",
            CORE_TIME,
            (
                _stepped(launches, _STEPS[::every]),
                _kept(launches, "held", every),
            ),
            launches.scene({"scheme": "held"}, _FINE, _FRAMES),
        ),
        Problem(
            "flight",
            "free flight",
            CORE_TIME,
            (
                _stepped(flights, _STEPS[::every]),
                _kept(flights, "held", every),
                _kept(flights, "implicit", every),
            ),
            flights.scene({"scheme": "held"}, _FINE, _FRAMES),
        ),
        Problem(
            "stokes",
            "implicit drag below Re 1",
            "steps per relaxation",
            (
                _implicit(_Flights(SYRUP, _SLOW, _SIZES), "pushed", every, 2.0, _CRANK),
                _implicit(_Launches(SYRUP, _CREEPING, _SIZES), "launched", every, 1.0, _MISSED),
            ),
        ),
    ]


class _Lanes:
    """Spheres side by side in one fluid, and what they do exactly."""

    viscosity_pa_s: float
    radii_m: NDArray[np.float64]
    launched_m_s: NDArray[np.float64]
    gradient_pa_m = 0.0
    #: Shortest time scale, by which steps and intervals are counted.
    quickest_s: float
    #: A speed that none of them exceeds.
    fastest_m_s: float

    def scene(self, drag: Mapping[str, Any], per_relaxation: int, steps: int) -> Scene:
        """All of them, with so many steps for the shortest relaxation."""
        step_s = self.quickest_s / per_relaxation
        room = 2.0 * float(self.radii_m.max())
        far = self.fastest_m_s * step_s * steps + room
        spheres = zip(self.radii_m.tolist(), self.launched_m_s.tolist(), strict=True)
        pressure = {"pressure": {"gradient": self.gradient_pa_m}} if self.gradient_pa_m else {}
        return make_scene(
            {
                "title": "spheres in a fluid at rest",
                "fluid": {"density": FLUID_KG_M3, "viscosity": self.viscosity_pa_s},
                # They never touch. So soft a material keeps the contacts' bound out of the way.
                "particles": {
                    "density": DENSITY_KG_M3,
                    "youngs_modulus": 1.0,
                    "poissons_ratio": 0.25,
                },
                "spheres": [
                    {
                        "radius": radius,
                        "position": [0.0, 2.0 * room * lane, 0.0],
                        "velocity": [speed, 0.0, 0.0],
                    }
                    for lane, (radius, speed) in enumerate(spheres)
                ],
                **pressure,
                "drag": dict(drag),
                "contact": {"restitution": 0.5},
                "box": {"low": [-room] * 3, "high": [far, 2.0 * room * len(self.radii_m), room]},
                "time": {"duration": step_s * steps, "step": step_s, "step_fraction": 1.0},
                "output": {"samples": _FRAMES, "frames": _FRAMES, "images": 0},
            }
        )

    def motion(
        self, times_s: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Speeds and ways ``(times, spheres)``."""
        raise NotImplementedError

    def errors(self, run: Moved) -> dict[str, float]:
        """Largest errors in any frame, over the largest speed and the whole way: r.m.s. of all."""
        speeds, ways = self.motion(run.times_s)
        velocity = np.abs(run.velocities_m_s[:, :, 0] - speeds).max(axis=0) / speeds.max(axis=0)
        place = np.abs(run.positions_m[:, :, 0] - ways).max(axis=0) / ways[-1]
        return {
            "velocity": float(np.sqrt((velocity**2).mean())),
            "place": float(np.sqrt((place**2).mean())),
        }


class _Launches(_Lanes):
    """Equal spheres, launched at speeds whose Reynolds numbers cover a range evenly."""

    def __init__(self, viscosity_pa_s: float, reynolds: tuple[float, float], count: int) -> None:
        self.viscosity_pa_s = viscosity_pa_s
        self.radii_m = np.full(count, RADIUS_M)
        sphere = _sphere(RADIUS_M, viscosity_pa_s)
        self.launched_m_s = np.geomspace(*reynolds, count) * sphere.speed_at(1.0)
        self._launches = [Launch(sphere, speed) for speed in self.launched_m_s.tolist()]
        self.quickest_s = min(launch.relaxation_s for launch in self._launches)
        self.fastest_m_s = float(self.launched_m_s.max())

    def motion(
        self, times_s: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        speeds = [launch.speeds_m_s(times_s) for launch in self._launches]
        ways = [launch.ways_m(times_s) for launch in self._launches]
        return np.array(speeds).T, np.array(ways).T


class _Flights(_Lanes):
    """Spheres of a few sizes, pushed from rest by a pressure gradient."""

    def __init__(self, viscosity_pa_s: float, reynolds: float, count: int) -> None:
        self.viscosity_pa_s = viscosity_pa_s
        sizes = RADIUS_M * np.geomspace(1.0 / _SPREAD, _SPREAD, _SIZES)
        self.radii_m = np.resize(sizes, count)
        self.launched_m_s = np.zeros(count)
        middle = _sphere(RADIUS_M, viscosity_pa_s)
        force = middle.drag_n(middle.speed_at(reynolds), middle.branch_at(reynolds))
        self.gradient_pa_m = force / pressure_force_n(RADIUS_M, 1.0)
        self._falls = [
            Fall(_sphere(radius, viscosity_pa_s), pressure_force_n(radius, self.gradient_pa_m))
            for radius in sizes.tolist()
        ]
        self.quickest_s = min(fall.relaxation_s for fall in self._falls)
        # The implicit scheme may shoot past the final speed in a long step, by less than itself.
        self.fastest_m_s = 2.0 * max(fall.final_speed_m_s for fall in self._falls)

    def motion(
        self, times_s: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        motions = [fall.motion(times_s) for fall in self._falls]
        which = np.resize(np.arange(_SIZES), len(self.radii_m))
        speeds, ways = (np.array(part).T[:, which] for part in zip(*motions, strict=True))
        return speeds, ways


def _stepped(lanes: _Lanes, steps: Sequence[int]) -> Knob:
    """The exact scheme against its step."""
    trials = tuple(
        Trial(1.0 / n, lanes.scene({"scheme": "exact"}, n, _RELAXATIONS * n), lanes.errors)
        for n in steps
    )
    # 0.05: the next term, 1 % of the first at the longest step; and the errors' own scatter.
    expected = tuple(Expected(quantity, 1.0, 0.05, _LATE) for quantity in _QUANTITIES)
    return Knob("exact", "step / relaxation", trials, expected)


def _kept(lanes: _Lanes, scheme: str, every: int) -> Knob:
    """A scheme that keeps something against the interval for which it does."""
    step_s = lanes.quickest_s / _FINE
    trials = tuple(
        Trial(
            kept / _FINE,
            lanes.scene({"scheme": scheme, "refresh": kept * step_s}, _FINE, _RELAXATIONS * _FINE),
            lanes.errors,
        )
        for kept in _KEPT[::every]
    )
    # 0.15: the next term, at most a tenth of the first; and steps are an eighth of the shortest
    # interval.
    expected = tuple(Expected(quantity, 2.0, 0.15, _MIDDLE) for quantity in _QUANTITIES)
    return Knob(scheme, "refresh / relaxation", trials, expected)


def _implicit(lanes: _Lanes, title: str, every: int, order: float, why: str) -> Knob:
    """The implicit scheme against its step, where it has nothing to keep."""
    trials = tuple(
        Trial(1.0 / n, lanes.scene({"scheme": "implicit"}, n, _RELAXATIONS * n), lanes.errors, n)
        for n in _SLOW_STEPS[::every]
    )
    # 0.05: the next term is of an order more at least, and 5 % of the first at the longest step.
    expected = tuple(Expected(quantity, order, 0.05, why) for quantity in _QUANTITIES)
    return Knob(title, "step / relaxation", trials, expected)


def _sphere(radius_m: float, viscosity_pa_s: float) -> Immersed:
    return Immersed(radius_m, DENSITY_KG_M3, FLUID_KG_M3, viscosity_pa_s)
