"""The Darcy-like law of a particle-laden fluid, forwards and backwards (Eqs. 12 to 16).

Sign convention: a positive `pressure_gradient_pa_m` is the pressure *drop* per length along the
flow, ``(p_inlet - p_outlet) / L``, so flux and flow rate are then positive. The paper's Eqs. 12, 13
and 15 carry a minus sign instead, which makes its printed ratio negative (-7.82e3 Pa s/m2).

Arguments are floats or arrays, in SI units, and broadcast against each other. They are formulas:
the ranges of the arguments are checked once, by `DarcyInputs`. `permeability_m2` is the effective
permeability P*, `viscosity_pa_s` the effective viscosity mu*.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from liggghts_driver.darcy.mixtures import FloatOrArray

# Far above the rounding of a few products (1e-15), far below the accuracy of any measurement.
ROUNDING = 1e-12


def darcy_flux(
    *,
    pressure_gradient_pa_m: FloatOrArray,
    permeability_m2: FloatOrArray,
    viscosity_pa_s: FloatOrArray,
) -> FloatOrArray:
    """Return the Darcy flux q in m/s, Eq. 13: flow rate per area of the whole section."""
    return permeability_m2 / viscosity_pa_s * pressure_gradient_pa_m


def flow_rate(*, flux_m_s: FloatOrArray, area_m2: FloatOrArray) -> FloatOrArray:
    """Return the flow rate Q = q A in m3/s of fluid and particles together, Eq. 12."""
    return flux_m_s * area_m2


def particle_flow_rate(
    *, flow_rate_m3_s: FloatOrArray, particle_fraction: FloatOrArray
) -> FloatOrArray:
    """Return the flow rate v_p Q in m3/s of the particles alone, those moving with the fluid."""
    return particle_fraction * flow_rate_m3_s


def pore_velocity(*, flux_m_s: FloatOrArray, pore_fraction: FloatOrArray) -> FloatOrArray:
    """Return the mean velocity q / v2 in m/s in the pores, the highly permeable zones."""
    return flux_m_s / pore_fraction


def gradient_to_flux(
    *, permeability_m2: FloatOrArray, viscosity_pa_s: FloatOrArray
) -> FloatOrArray:
    """Return the ratio of pressure gradient to flux, mu* / P*, in Pa s/m2, from Eq. 16.

    It is the positive magnitude; the paper prints the same ratio with its minus sign.
    """
    return viscosity_pa_s / permeability_m2


def gradient_for_flow_rate(
    *,
    flow_rate_m3_s: FloatOrArray,
    area_m2: FloatOrArray,
    permeability_m2: FloatOrArray,
    viscosity_pa_s: FloatOrArray,
) -> FloatOrArray:
    """Return the pressure gradient in Pa/m that drives a wanted flow rate, Eq. 12 solved for it."""
    resistance = gradient_to_flux(permeability_m2=permeability_m2, viscosity_pa_s=viscosity_pa_s)
    return resistance * flow_rate_m3_s / area_m2


def inlet_pressure(
    *,
    flow_rate_m3_s: FloatOrArray,
    outlet_pressure_pa: FloatOrArray,
    length_m: FloatOrArray,
    area_m2: FloatOrArray,
    permeability_m2: FloatOrArray,
    viscosity_pa_s: FloatOrArray,
) -> FloatOrArray:
    """Return the inlet pressure p+ in Pa for a wanted flow rate, from Eqs. 12 and 14."""
    gradient = gradient_for_flow_rate(
        flow_rate_m3_s=flow_rate_m3_s,
        area_m2=area_m2,
        permeability_m2=permeability_m2,
        viscosity_pa_s=viscosity_pa_s,
    )
    return outlet_pressure_pa + gradient * length_m


def calibrate_phi(
    *,
    flow_rate_m3_s: FloatOrArray,
    pressure_gradient_pa_m: FloatOrArray,
    area_m2: FloatOrArray,
    viscosity_pa_s: FloatOrArray,
    permeability_lower_m2: FloatOrArray,
    permeability_upper_m2: FloatOrArray,
) -> FloatOrArray:
    """Return the phi of Eq. 11 with which the law gives a measured flow rate.

    Parameters
    ----------
    flow_rate_m3_s
        Measured flow rate of fluid and particles together; divide a flow rate of particles by
        their fraction first.
    pressure_gradient_pa_m
        Gradient at which it was measured, not 0.
    area_m2, viscosity_pa_s
        Section and effective viscosity.
    permeability_lower_m2, permeability_upper_m2
        The two bounds, Eq. 10.

    Returns
    -------
    phi
        In [0, 1].

    Raises
    ------
    ValueError
        If the bounds coincide, so that phi has no effect; or if the flow rate lies outside what
        the bounds allow, with the flow rate and the reachable range in the message.
    """
    lower, upper = np.asarray(permeability_lower_m2), np.asarray(permeability_upper_m2)
    if not np.all(upper - lower > ROUNDING * upper):
        raise ValueError(
            f"phi cannot be calibrated: permeability_lower_m2 = {lower} must be below"
            f" permeability_upper_m2 = {upper}"
        )
    # In flow rates rather than permeabilities, so that a gradient of 0 needs no division.
    at_unit = np.asarray(area_m2 * pressure_gradient_pa_m / viscosity_pa_s)
    flow, slowest, fastest = np.asarray(flow_rate_m3_s), at_unit * lower, at_unit * upper
    slack = ROUNDING * np.abs(fastest)
    # A flow against the gradient has the other sign; the direction makes both cases one.
    direction = np.sign(at_unit)
    below, above = direction * (slowest - flow), direction * (flow - fastest)
    if not np.all((direction != 0) & (below <= slack) & (above <= slack)):
        raise ValueError(
            f"flow_rate_m3_s = {flow} is out of reach at pressure_gradient_pa_m ="
            f" {pressure_gradient_pa_m}: phi = 0 gives {slowest} and phi = 1 gives {fastest}"
        )
    phi: FloatOrArray = np.clip((flow - slowest) / (fastest - slowest), 0, 1)
    return phi


def reynolds_number(
    *,
    speed_m_s: FloatOrArray,
    particle_radius_m: FloatOrArray,
    fluid_density_kg_m3: FloatOrArray,
    fluid_viscosity_pa_s: FloatOrArray,
) -> FloatOrArray:
    """Return the Reynolds number ``2 rho_f r |speed| / mu_f``, in the form of Eq. 19.

    The paper asks for Re below about 10 but does not say which speed and length make it. Here they
    are the radius of the carried particles and, in `estimate`, the Darcy flux q. That reading
    agrees with the paper's example, where 10 Pa/m is still inside the limit (Re = 7.4) and 20 Pa/m
    is the first gradient outside (Re = 15). With the pore velocity q / v2 the same two would be at
    17 and 33, both outside; whoever prefers it passes it as `speed_m_s`.
    """
    return 2 * fluid_density_kg_m3 * particle_radius_m * np.abs(speed_m_s) / fluid_viscosity_pa_s
