"""The Darcy estimate of a scene.

Knows the scene and nothing of decks or results, so that the comparison stays independent.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.darcy import DarcyInputs, Estimate, estimate, gradient_for
from liggghts_driver.errors import SceneError
from liggghts_driver.scene.layout import layout, particle_fraction

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from liggghts_driver.scene.model import Pressure, Scene


class NoDarcyError(SceneError):
    """Darcy's law says nothing about a scene."""


def darcy_inputs(scene: Scene) -> DarcyInputs:
    """What Eqs. 1-16 need, from a scene.

    Raises
    ------
    NoDarcyError
        If the scene has no specimen, fluid or particles of a stated size: Darcy's law then says
        nothing about it.
    """
    needs = {
        "[specimen]": scene.specimen,
        "[fluid]": scene.fluid,
        "particles.radius_mean": scene.particles.radius_mean,
    }
    missing = [name for name, value in needs.items() if value is None]
    if missing:
        raise NoDarcyError(f"Darcy's law needs {', '.join(missing)}; this scene has none")
    specimen, fluid, radius = scene.specimen, scene.fluid, scene.particles.radius_mean
    assert specimen is not None
    assert fluid is not None
    assert radius is not None
    place = layout(scene)
    return DarcyInputs(
        fluid_density_kg_m3=fluid.density,
        particle_density_kg_m3=scene.particles.density,
        fluid_viscosity_pa_s=fluid.viscosity,
        particle_fraction=particle_fraction(scene, place),
        particle_radius_m=radius,
        permeability_1_m2=specimen.permeability_grains,
        permeability_2_m2=specimen.permeability_matrix,
        solid_fraction=specimen.solid_fraction,
        phi=specimen.phi,
        area_m2=place.area_m2,
        length_m=specimen.length,
    )


def predict(scene: Scene, gradient_pa_m: float | NDArray[np.float64] | None = None) -> Estimate:
    """The Darcy estimate of a scene, at its own pressure gradient or at others.

    Of a gradient that goes to and fro it is the steady flow at its largest; a warning says so.

    Raises
    ------
    NoDarcyError
        If Darcy's law does not apply to the scene, or no gradient is known.
    """
    inputs = darcy_inputs(scene)
    if gradient_pa_m is None:
        if scene.pressure is None:
            raise NoDarcyError("pressure.gradient (missing): Darcy's law needs it; add [pressure]")
        found = estimate(inputs, scene.pressure.gradient)
        return found if scene.pressure.period is None else _at_its_largest(found, scene.pressure)
    return estimate(inputs, gradient_pa_m)


def _at_its_largest(found: Estimate, pressure: Pressure) -> Estimate:
    warning = (
        f"pressure.period = {pressure.period:g} s: Darcy's law is about a steady flow; this one is "
        f"what {pressure.gradient:g} Pa/m would drive for ever"
    )
    return replace(found, valid=False, warnings=(*found.warnings, warning))


def steady_estimate(scene: Scene) -> Estimate:
    """The Darcy estimate that a simulation of the scene can be held against.

    Raises
    ------
    NoDarcyError
        If Darcy's law does not apply to the scene: also where its gradient goes to and fro.
    """
    if scene.pressure is not None and scene.pressure.period is not None:
        raise NoDarcyError(
            f"pressure.period = {scene.pressure.period:g} s: Darcy's law is about a steady flow"
        )
    return predict(scene)


def predict_gradient(scene: Scene, flow_rate_m3_s: float) -> Estimate:
    """The same, backwards: at the gradient that a flow rate of the suspension needs.

    Raises
    ------
    NoDarcyError
        If Darcy's law does not apply to the scene.
    SceneError
        If the flow rate is no number.
    """
    if not math.isfinite(flow_rate_m3_s):
        raise SceneError(f"flow rate = {flow_rate_m3_s}: must be a finite number; give it in m3/s")
    return gradient_for(darcy_inputs(scene), flow_rate_m3_s=flow_rate_m3_s)


def pore_velocity_m_s(scene: Scene) -> float:
    """Darcy pore velocity q / v2 of a scene at its own pressure gradient.

    Raises
    ------
    NoDarcyError
        If Darcy's law does not apply to the scene.
    """
    return float(np.asarray(predict(scene).pore_velocity_m_s))
