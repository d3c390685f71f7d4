"""Darcy-like estimate of the infiltration of a particle-laden fluid into a porous solid."""

from liggghts_driver.darcy.estimate import DarcyInputs, Estimate, estimate, gradient_for
from liggghts_driver.darcy.law import (
    calibrate_phi,
    darcy_flux,
    flow_rate,
    gradient_for_flow_rate,
    gradient_to_flux,
    inlet_pressure,
    particle_flow_rate,
    pore_velocity,
    reynolds_number,
)
from liggghts_driver.darcy.mixtures import (
    bulk_modulus_bounds,
    combine_bounds,
    conductivity_bounds,
    effective_density,
    einstein_viscosity,
    shear_modulus_bounds,
    viscosity_lower_bound,
)

__all__ = [
    "DarcyInputs",
    "Estimate",
    "bulk_modulus_bounds",
    "calibrate_phi",
    "combine_bounds",
    "conductivity_bounds",
    "darcy_flux",
    "effective_density",
    "einstein_viscosity",
    "estimate",
    "flow_rate",
    "gradient_for",
    "gradient_for_flow_rate",
    "gradient_to_flux",
    "inlet_pressure",
    "particle_flow_rate",
    "pore_velocity",
    "reynolds_number",
    "shear_modulus_bounds",
    "viscosity_lower_bound",
]
