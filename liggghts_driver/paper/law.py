"""What theory says of the paper's example, computed here: its law, and a lone particle's flight."""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.integrate import solve_ivp

from liggghts_driver.loads import piston_mass_kg as piston_mass_of
from liggghts_driver.paper.catalogue import GRADIENT, sweep_file
from liggghts_driver.paper.printed import LARGEST_REYNOLDS, PARTICLES, TABLE_1
from liggghts_driver.physics.drag import (
    drag_coefficient_n_s_m,
    free_flight_speed_m_s,
    pressure_force_n,
)
from liggghts_driver.physics.drag import reynolds as reynolds_of
from liggghts_driver.physics.spheres import sphere_volume_m3
from liggghts_driver.prediction import predict
from liggghts_driver.resources import cases_dir
from liggghts_driver.scene import read_scene
from liggghts_driver.scene.layout import layout, mean_particle_volume_m3
from liggghts_driver.sweeps.draft import scene_with
from liggghts_driver.sweeps.plan import make_plan

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from liggghts_driver.darcy import Estimate
    from liggghts_driver.paper.catalogue import Series
    from liggghts_driver.scene.model import Fluid, Scene
    from liggghts_driver.sweeps.plan import Plan

    FloatArray = NDArray[np.float64]

#: Long beside the time in which a particle comes to free flight [s].
_LONG_S = 60.0


@cache
def example() -> Scene:
    """The paper's example, as shipped."""
    return read_scene(cases_dir() / "infiltration.toml")


@cache
def _plan(path: Path) -> Plan:
    """A sweep is planned once for all that is asked of it."""
    return make_plan(path)


def scene_of(sweep: str, values: Mapping[str, Any]) -> Scene:
    """The scene of a point of a shipped sweep."""
    return scene_with(_plan(sweep_file(sweep)).base, values)


def fluid_of(series: Series) -> Scene:
    """A scene with the fluid of a reading: all its sweeps have the same."""
    return scene_of(next(iter(series.parts)), {})


def gradients_of(series: Series) -> list[float]:
    """All gradients of a reading [Pa/m], the smallest first."""
    found = set()
    for name, chosen in series.parts.items():
        planned = {float(p.values[GRADIENT]) for p in _plan(sweep_file(name)).points}
        found |= set(chosen) or planned
    return sorted(found)


def flowing_share(flow_m3_s: float, velocity_m_s: float) -> float:
    """Flow rate over velocity and pores: the share of the example's pores that flows."""
    return flow_m3_s / (_pores_m2() * velocity_m_s)


def share_of_one() -> float:
    """The share of the specimen's pores that one mean particle fills."""
    specimen = example().specimen
    assert specimen is not None
    return sphere_volume_m3(_flier(None)[1]) / (_pores_m2() * specimen.length)


def _pores_m2() -> float:
    """The pores in a section of the specimen."""
    specimen = example().specimen
    assert specimen is not None
    return specimen.width**2 * (1.0 - specimen.solid_fraction)


def law(gradient_pa_m: float, scene: Scene | None = None) -> Estimate:
    """The Darcy-like law at one gradient (Eqs. 12-16); of the paper's example without a scene."""
    return predict(scene or example(), gradient_pa_m)


def law_flow_m3_s(gradient_pa_m: float) -> float:
    """Its flow rate of particles."""
    return float(np.asarray(law(gradient_pa_m).particle_flow_rate_m3_s))


def law_velocity_m_s(gradient_pa_m: float) -> float:
    """Its pore velocity q / v2."""
    return float(np.asarray(law(gradient_pa_m).pore_velocity_m_s))


def law_reynolds(gradient_pa_m: float, scene: Scene | None = None) -> float:
    """Its Reynolds number, of the Darcy flux and a particle's diameter."""
    return float(np.asarray(law(gradient_pa_m, scene).reynolds))


def is_slow(gradient_pa_m: float, scene: Scene | None = None) -> bool:
    """Whether the law is said to hold at a gradient: Re up to about 10."""
    return law_reynolds(gradient_pa_m, scene) <= LARGEST_REYNOLDS


def slow_gradients() -> tuple[float, float]:
    """The smallest and the largest gradient of Table 1 at which it is [Pa/m]."""
    slow = [row.gradient_pa_m for row in TABLE_1 if is_slow(row.gradient_pa_m)]
    return slow[0], slow[-1]


def free_flight_m_s(gradient_pa_m: float, scene: Scene | None = None) -> float:
    """The speed at which a lone mean particle flies inside the specimen (Eqs. 17-20)."""
    return _balanced_m_s(pressure_force_n(_flier(scene)[1], gradient_pa_m), scene)


def free_flight_reynolds(gradient_pa_m: float, scene: Scene | None = None) -> float:
    """The Reynolds number of that flight (Eq. 19)."""
    fluid, radius = _flier(scene)
    speed = free_flight_m_s(gradient_pa_m, scene)
    return float(reynolds_of(fluid.density, fluid.viscosity, radius, speed))


def to_the_middle_m() -> float:
    """From the entrance of the specimen to its middle."""
    specimen = example().specimen
    assert specimen is not None
    return specimen.length / 2.0


@cache
def piston_mass_kg() -> float:
    """The mass of the first reading's piston: that of the suspension before it."""
    scene = example()
    volume_m3 = PARTICLES * mean_particle_volume_m3(scene.particles)
    return piston_mass_of(scene, layout(scene), volume_m3)


def piston_force_n() -> float:
    """What pushes it at every gradient: its mass times its acceleration."""
    piston = example().piston
    assert piston is not None
    return piston_mass_kg() * piston.acceleration


def grain_reynolds(gradient_pa_m: float) -> float:
    """The law's Reynolds number with the diameter of a grain, as is usual for porous media."""
    return law_reynolds(gradient_pa_m) * size_ratio()


def pressure_force_on_one_n(gradient_pa_m: float) -> float:
    """The force of the gradient on the example's mean particle (Eq. 20)."""
    return pressure_force_n(_flier(None)[1], gradient_pa_m)


def suspension_speed_m_s(time_s: float) -> float:
    """The speed of a mean particle in a fluid that goes with the piston, which nothing holds.

    It lags by the speed at which drag gives it the piston's acceleration (Eqs. 17-19).
    """
    piston = example().piston
    assert piston is not None
    lag = _balanced_m_s(_particle_mass_kg() * piston.acceleration)
    return piston.acceleration * time_s - lag


def free_flight_by_volume_m_s(gradient_pa_m: float) -> float:
    """Free flight if the gradient pushed with volume times gradient, not with Eq. 20."""
    return _balanced_m_s(sphere_volume_m3(_flier(None)[1]) * gradient_pa_m)


def _balanced_m_s(force_n: float, scene: Scene | None = None) -> float:
    """The speed at which drag balances a force on a mean particle (Eqs. 17-19)."""
    fluid, radius = _flier(scene)
    return free_flight_speed_m_s(fluid.density, fluid.viscosity, radius, force_n)


def _particle_mass_kg() -> float:
    """Of the example's mean particle."""
    density = example().particles.density
    assert density is not None
    return density * sphere_volume_m3(_flier(None)[1])


def mixture_reynolds(gradient_pa_m: float) -> float:
    """The law's Reynolds number with the viscosity of the mixture (Eq. 6), which its flux has."""
    found, fluid = law(gradient_pa_m), _flier(None)[0]
    return law_reynolds(gradient_pa_m) * fluid.viscosity / found.effective_viscosity_pa_s


def size_ratio() -> float:
    """A mean grain over a mean particle."""
    grains = example().grains
    assert grains is not None
    assert grains.radius_mean is not None
    return grains.radius_mean / _flier(None)[1]


def drag_over_pressure_force(time_s: float, gradient_pa_m: float) -> float:
    """The drag of a fluid with v_f = a t on a mean particle at rest, over Eq. 20 (Eqs. 17-19)."""
    piston, (fluid, radius) = example().piston, _flier(None)
    assert piston is not None
    speed = piston.acceleration * time_s
    coefficient = drag_coefficient_n_s_m(fluid.density, fluid.viscosity, radius, speed)
    return float(coefficient) * speed / pressure_force_on_one_n(gradient_pa_m)


def carried_m(speed_m_s: float, gradient_pa_m: float) -> float:
    """How far a lone mean particle gets ahead of one in free flight that enters so fast."""
    (fluid, radius), mass = _flier(None), _particle_mass_kg()
    force, free = pressure_force_n(radius, gradient_pa_m), free_flight_m_s(gradient_pa_m)

    def slows(_time_s: float, state: FloatArray) -> list[float]:
        speed = float(state[1])
        drag = drag_coefficient_n_s_m(fluid.density, fluid.viscosity, radius, speed)
        return [speed - free, (force - float(drag) * speed) / mass]

    found = solve_ivp(slows, (0.0, _LONG_S), [0.0, speed_m_s], rtol=1e-6)
    return float(found.y[0, -1])


def _flier(scene: Scene | None) -> tuple[Fluid, float]:
    """The fluid of a scene, of the paper's without one, and the radius of its mean particle."""
    scene = scene or example()
    fluid, radius = scene.fluid, scene.particles.radius_mean
    assert fluid is not None
    assert radius is not None
    return fluid, radius


def free_flight_exponent(low_pa_m: float, high_pa_m: float, scene: Scene | None = None) -> float:
    """The power of the gradient with which the free flight goes between two gradients."""
    ratio = free_flight_m_s(high_pa_m, scene) / free_flight_m_s(low_pa_m, scene)
    return math.log(ratio) / math.log(high_pa_m / low_pa_m)
