"""The estimator: everything the Darcy-like law says about one case, with its validity."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from liggghts_driver.darcy import law
from liggghts_driver.darcy.mixtures import (
    combine_bounds,
    conductivity_bounds,
    effective_density,
    viscosity_lower_bound,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from liggghts_driver.darcy.mixtures import FloatArray, FloatOrArray

MAX_PARTICLE_FRACTION = 0.15  # accuracy of Eq. 6
MAX_REYNOLDS = 10.0  # slow, viscous flow

ASSUMPTIONS = (
    "Both phases of the porous solid are isotropic, and so is their mixture.",
    "The particles are rigid, the fluid is incompressible and their mixture is isotropic.",
    "The flow is steady and the pressure gradient is the same along the whole length.",
    "The particles move with the fluid: their share of the flow rate is their volume fraction.",
)

_Rule: TypeAlias = tuple[Callable[[float], bool], str]

# NaN satisfies no comparison, so these refuse it without another word.
_POSITIVE: _Rule = (lambda x: 0 < x < np.inf, "must be > 0 and finite")
_NOT_NEGATIVE: _Rule = (lambda x: 0 <= x < np.inf, "must be >= 0 and finite")
_FRACTION: _Rule = (lambda x: 0 <= x < 1, "must be in [0, 1)")
_WEIGHT: _Rule = (lambda x: 0 <= x <= 1, "must be in [0, 1]")

_RULES: dict[str, _Rule] = {
    "fluid_density_kg_m3": _POSITIVE,
    "particle_density_kg_m3": _POSITIVE,
    "fluid_viscosity_pa_s": _POSITIVE,
    "particle_fraction": _FRACTION,
    "particle_radius_m": _POSITIVE,
    "permeability_1_m2": _NOT_NEGATIVE,
    "permeability_2_m2": _POSITIVE,
    "solid_fraction": _FRACTION,
    "phi": _WEIGHT,
    "area_m2": _POSITIVE,
    "length_m": _POSITIVE,
}


@dataclass(frozen=True, kw_only=True)
class DarcyInputs:
    """What the law needs to know, as floats in SI units.

    Attributes
    ----------
    fluid_density_kg_m3, particle_density_kg_m3
        Densities of the base fluid and of the carried particles, > 0.
    fluid_viscosity_pa_s
        Viscosity of the base fluid, > 0.
    particle_fraction
        Volume fraction v_p of the particles in the fluid, in [0, 1).
    particle_radius_m
        Mean radius of the particles, > 0.
    permeability_1_m2, permeability_2_m2
        Permeability of the grains, >= 0, and of the matrix between them, > 0 and not below that
        of the grains.
    solid_fraction
        Volume fraction v1 of the grains in the solid, in [0, 1).
    phi
        Weight of the upper bound of the permeability (Eq. 11), in [0, 1].
    area_m2, length_m
        Cross-section and length of the solid along the flow, > 0.

    Raises
    ------
    ValueError
        If values are outside these ranges; one message names them all.
    """

    fluid_density_kg_m3: float
    particle_density_kg_m3: float
    fluid_viscosity_pa_s: float
    particle_fraction: float
    particle_radius_m: float
    permeability_1_m2: float
    permeability_2_m2: float
    solid_fraction: float
    phi: float
    area_m2: float
    length_m: float

    def __post_init__(self) -> None:
        faults = [
            f"{name} = {getattr(self, name)}: {bound}"
            for name, (holds, bound) in _RULES.items()
            if not holds(getattr(self, name))
        ]
        if self.permeability_2_m2 < self.permeability_1_m2:
            faults.append(
                f"permeability_2_m2 = {self.permeability_2_m2}: must be >= permeability_1_m2 ="
                f" {self.permeability_1_m2}, or the bounds change places"
            )
        if faults:
            raise ValueError("; ".join(faults))


@dataclass(frozen=True, kw_only=True, eq=False)
class Estimate:
    """Answer of the law.

    The first group of fields holds floats. The second has the shape of the gradient that was asked
    for, floats for a float. `valid` says, for each gradient, whether the case is inside the range
    in which the law is trusted; `warnings` say what is outside, with value and bound; `assumptions`
    are what no input can tell.
    """

    effective_density_kg_m3: float
    effective_viscosity_pa_s: float
    permeability_lower_m2: float
    permeability_upper_m2: float
    effective_permeability_m2: float
    gradient_to_flux_pa_s_m2: float

    pressure_gradient_pa_m: FloatOrArray
    pressure_drop_pa: FloatOrArray
    darcy_flux_m_s: FloatOrArray
    flow_rate_m3_s: FloatOrArray
    particle_flow_rate_m3_s: FloatOrArray
    pore_velocity_m_s: FloatOrArray
    reynolds: FloatOrArray
    valid: bool | NDArray[np.bool_]

    warnings: tuple[str, ...]
    assumptions: tuple[str, ...]

    def as_dict(self) -> dict[str, object]:
        """Return the fields as plain floats, bools, strings and lists, fit for JSON."""
        return {field.name: _plain(getattr(self, field.name)) for field in fields(self)}


def estimate(inputs: DarcyInputs, pressure_gradient_pa_m: FloatOrArray) -> Estimate:
    """Return all answers of the law at one pressure gradient or at an array of them.

    Parameters
    ----------
    inputs
        The case.
    pressure_gradient_pa_m
        Pressure drop per length along the flow, of any shape; a negative one reverses the flow.

    Raises
    ------
    ValueError
        If a gradient is not finite, or the effective permeability is 0.
    """
    gradient = np.array(pressure_gradient_pa_m, dtype=np.float64)
    if not np.all(np.isfinite(gradient)):
        raise ValueError(f"pressure_gradient_pa_m = {pressure_gradient_pa_m}: must be finite")
    density = effective_density(
        inputs.fluid_density_kg_m3, inputs.particle_density_kg_m3, inputs.particle_fraction
    )
    viscosity = _viscosity(inputs)
    lower, upper, permeability = _permeabilities(inputs)
    flux = law.darcy_flux(
        pressure_gradient_pa_m=gradient, permeability_m2=permeability, viscosity_pa_s=viscosity
    )
    ratio = law.gradient_to_flux(permeability_m2=permeability, viscosity_pa_s=viscosity)
    flow = law.flow_rate(flux_m_s=flux, area_m2=inputs.area_m2)
    particle_flow = law.particle_flow_rate(
        flow_rate_m3_s=flow, particle_fraction=inputs.particle_fraction
    )
    velocity = law.pore_velocity(flux_m_s=flux, pore_fraction=1 - inputs.solid_fraction)
    reynolds = law.reynolds_number(
        speed_m_s=flux,
        particle_radius_m=inputs.particle_radius_m,
        fluid_density_kg_m3=inputs.fluid_density_kg_m3,
        fluid_viscosity_pa_s=inputs.fluid_viscosity_pa_s,
    )
    dilute, slow = inputs.particle_fraction <= MAX_PARTICLE_FRACTION, reynolds <= MAX_REYNOLDS
    return Estimate(
        effective_density_kg_m3=float(density),
        effective_viscosity_pa_s=viscosity,
        permeability_lower_m2=lower,
        permeability_upper_m2=upper,
        effective_permeability_m2=permeability,
        gradient_to_flux_pa_s_m2=float(ratio),
        pressure_gradient_pa_m=_native(gradient),
        pressure_drop_pa=_native(gradient * inputs.length_m),
        darcy_flux_m_s=_native(flux),
        flow_rate_m3_s=_native(flow),
        particle_flow_rate_m3_s=_native(particle_flow),
        pore_velocity_m_s=_native(velocity),
        reynolds=_native(reynolds),
        valid=_native(np.logical_and(dilute, slow)),
        warnings=_warnings(inputs, gradient, np.asarray(reynolds)),
        assumptions=ASSUMPTIONS,
    )


def gradient_for(inputs: DarcyInputs, *, flow_rate_m3_s: FloatOrArray) -> Estimate:
    """Return the estimate at the gradient that drives a wanted flow rate of fluid and particles.

    `flow_rate_m3_s` may have any shape; the answer has the same.

    Raises
    ------
    ValueError
        If a flow rate is not finite, or the effective permeability is 0.
    """
    if not np.all(np.isfinite(flow_rate_m3_s)):
        raise ValueError(f"flow_rate_m3_s = {flow_rate_m3_s}: must be finite")
    gradient = law.gradient_for_flow_rate(
        flow_rate_m3_s=np.asarray(flow_rate_m3_s, dtype=np.float64),
        area_m2=inputs.area_m2,
        permeability_m2=_permeabilities(inputs)[-1],
        viscosity_pa_s=_viscosity(inputs),
    )
    return estimate(inputs, gradient)


def _viscosity(inputs: DarcyInputs) -> float:
    return float(viscosity_lower_bound(inputs.fluid_viscosity_pa_s, inputs.particle_fraction))


def _permeabilities(inputs: DarcyInputs) -> tuple[float, float, float]:
    """Return both bounds and the effective permeability; it must not be 0."""
    lower, upper = conductivity_bounds(
        inputs.permeability_1_m2, inputs.permeability_2_m2, 1 - inputs.solid_fraction
    )
    effective = float(combine_bounds(lower, upper, inputs.phi))
    if effective == 0:
        raise ValueError(
            f"phi = {inputs.phi} with permeability_1_m2 = {inputs.permeability_1_m2} gives an"
            " effective permeability of 0, so nothing flows: one of them must be > 0"
        )
    return float(lower), float(upper), effective


def _warnings(inputs: DarcyInputs, gradient: FloatArray, reynolds: FloatArray) -> tuple[str, ...]:
    """Return a sentence for each bound of the law's validity that is not kept."""
    sentences = []
    if inputs.particle_fraction > MAX_PARTICLE_FRACTION:
        sentences.append(
            f"particle_fraction = {inputs.particle_fraction:g} exceeds {MAX_PARTICLE_FRACTION:g}:"
            " the effective viscosity is only a lower bound there, so the flow is overestimated."
        )
    fast = reynolds > MAX_REYNOLDS
    if np.any(fast):
        cases = zip(reynolds[fast], gradient[fast], strict=True)
        listed = ", ".join(f"{re:.3g} at {slope:g} Pa/m" for re, slope in cases)
        sentences.append(
            f"reynolds = {listed} exceeds {MAX_REYNOLDS:g}: the flow is too fast for the law, which"
            " then overestimates it."
        )
    return tuple(sentences)


def _native(value: Any) -> Any:
    """Return a float or a bool for an array without dimensions, else the array."""
    array = np.asarray(value)
    return array.item() if array.ndim == 0 else array


def _plain(value: object) -> object:
    return list(value) if isinstance(value, tuple) else np.asarray(value).tolist()
