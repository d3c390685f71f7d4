"""Effective properties of two-phase mixtures (Eqs. 1 to 11).

Every argument is a float or an array; arrays broadcast against each other and the answer has
their common shape.

All the Hashin-Shtrikman bounds are one formula. A property ``p`` of the mixture obeys

    1 / (p + z) = v1 / (p1 + z) + v2 / (p2 + z),

where ``z`` belongs to a comparison medium: that of the softer phase gives the lower bound, that of
the stiffer phase the upper one. ``z = 0`` would be the harmonic mean and ``z = inf`` the arithmetic
mean, and ``p`` grows with ``z``, which is why the bounds are ordered.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
FloatOrArray: TypeAlias = float | FloatArray


def effective_density(
    fluid_density_kg_m3: FloatOrArray,
    particle_density_kg_m3: FloatOrArray,
    particle_fraction: FloatOrArray,
) -> FloatOrArray:
    """Return the density of the particle-laden fluid in kg/m3, Eq. 1."""
    fluid_fraction = 1 - particle_fraction
    return fluid_fraction * fluid_density_kg_m3 + particle_fraction * particle_density_kg_m3


def einstein_viscosity(
    fluid_viscosity_pa_s: FloatOrArray, particle_fraction: FloatOrArray
) -> FloatOrArray:
    """Return Einstein's effective viscosity in Pa s, Eq. 3; good below a fraction of 0.01."""
    return fluid_viscosity_pa_s * (1 + 2.5 * particle_fraction)


def viscosity_lower_bound(
    fluid_viscosity_pa_s: FloatOrArray, particle_fraction: FloatOrArray
) -> FloatOrArray:
    """Return the lower bound of the effective viscosity in Pa s, Eq. 6.

    It is the lower bound of the shear modulus (Eq. 5) for rigid particles in an incompressible
    matrix whose shear modulus is read as a viscosity. It serves as the viscosity itself up to a
    particle fraction of about 0.15.

    Raises
    ------
    ValueError
        If `particle_fraction` is not in [0, 1); the bound diverges at 1.
    """
    fraction = np.asarray(particle_fraction, dtype=np.float64)
    _require((fraction >= 0) & (fraction < 1), f"particle_fraction = {fraction}: must be in [0, 1)")
    return fluid_viscosity_pa_s * (1 + 2.5 * fraction / (1 - fraction))


def bulk_modulus_bounds(
    bulk_1: FloatOrArray,
    shear_1: FloatOrArray,
    bulk_2: FloatOrArray,
    shear_2: FloatOrArray,
    fraction_2: FloatOrArray,
) -> tuple[FloatOrArray, FloatOrArray]:
    """Return the Hashin-Shtrikman bounds of the bulk modulus, Eq. 4.

    Parameters
    ----------
    bulk_1, shear_1
        Moduli of the softer phase, all four in the same unit (Pa).
    bulk_2, shear_2
        Moduli of the stiffer phase; finite, but as large as wanted.
    fraction_2
        Volume fraction of the stiffer phase, in [0, 1].

    Returns
    -------
    lower, upper
        In the unit of the moduli.

    Raises
    ------
    ValueError
        If a modulus is negative or not finite, `bulk_1` is 0, phase 2 is softer than phase 1, or
        the fraction is not in [0, 1].
    """
    _check_moduli(bulk_1, shear_1, bulk_2, shear_2)
    return _bounds(bulk_1, bulk_2, fraction_2, _scaled(shear_1, 4 / 3), _scaled(shear_2, 4 / 3))


def shear_modulus_bounds(
    bulk_1: FloatOrArray,
    shear_1: FloatOrArray,
    bulk_2: FloatOrArray,
    shear_2: FloatOrArray,
    fraction_2: FloatOrArray,
) -> tuple[FloatOrArray, FloatOrArray]:
    """Return the Hashin-Shtrikman bounds of the shear modulus, Eq. 5.

    Parameters, returned values and errors are those of `bulk_modulus_bounds`.
    """
    _check_moduli(bulk_1, shear_1, bulk_2, shear_2)
    z_1 = _shear_comparison(bulk_1, shear_1)
    z_2 = _shear_comparison(bulk_2, shear_2)
    return _bounds(shear_1, shear_2, fraction_2, z_1, z_2)


def conductivity_bounds(
    phase_1: FloatOrArray, phase_2: FloatOrArray, fraction_2: FloatOrArray
) -> tuple[FloatOrArray, FloatOrArray]:
    """Return the Hashin-Shtrikman bounds of a conductivity-like property, Eqs. 9 and 10.

    Conductivity-like is any property that ties a divergence-free flux to a gradient: the
    permeability (m2) of the porous solid, and likewise the electric permittivity, magnetic
    permeability, thermal or electrical conductivity of the infiltrated solid.

    Parameters
    ----------
    phase_1
        Property of the less conducting phase, >= 0. With 0 the lower bound is 0, unless phase 2
        fills everything.
    phase_2
        Property of the more conducting phase, > 0, in the same unit. Where it equals `phase_1` so
        do both bounds.
    fraction_2
        Volume fraction of phase 2, in [0, 1].

    Returns
    -------
    lower, upper
        In the unit of the phases.

    Raises
    ------
    ValueError
        If phase 2 conducts less than phase 1 (the bounds would change places), or an argument is
        outside its range or not finite.
    """
    _check_phases("phase_1", phase_1, "phase_2", phase_2)
    return _bounds(phase_1, phase_2, fraction_2, _scaled(phase_1, 2), _scaled(phase_2, 2))


def combine_bounds(lower: FloatOrArray, upper: FloatOrArray, phi: FloatOrArray) -> FloatOrArray:
    """Return the convex combination of two bounds, Eq. 11: ``(1 - phi) lower + phi upper``.

    ``phi = 0`` is the lower bound and ``phi = 1`` the upper one, as the paper says beneath Eq. 11.
    Its Eqs. 15 and 16 give phi to the *lower* bound instead, which contradicts Eq. 11 unless
    phi = 1/2; Eq. 11 is the definition here.

    Raises
    ------
    ValueError
        If `phi` is not in [0, 1].
    """
    weight = np.asarray(phi, dtype=np.float64)
    _require((weight >= 0) & (weight <= 1), f"phi = {weight}: must be in [0, 1]")
    return (1 - weight) * lower + weight * upper


def _bounds(
    p1: FloatOrArray, p2: FloatOrArray, v2: FloatOrArray, z1: FloatArray, z2: FloatArray
) -> tuple[FloatOrArray, FloatOrArray]:
    """Return the mixture's property against the comparison media of phase 1 and of phase 2."""
    fraction_2 = np.asarray(v2, dtype=np.float64)
    _require((fraction_2 >= 0) & (fraction_2 <= 1), f"fraction_2 = {fraction_2}: must be in [0, 1]")
    phase_1, phase_2 = np.asarray(p1, dtype=np.float64), np.asarray(p2, dtype=np.float64)
    return _mix(phase_1, phase_2, fraction_2, z1), _mix(phase_1, phase_2, fraction_2, z2)


def _mix(p1: FloatArray, p2: FloatArray, v2: FloatArray, z: FloatArray) -> FloatOrArray:
    """Solve the module's formula for the mixture's property.

    Numerator and denominator are divided by `p2`, the larger one, so that nothing overflows for a
    nearly rigid phase 2. No term is negative, so nothing cancels however far apart the phases are.
    """
    v1 = 1 - v2
    ratio = p1 / p2
    numerator = p1 + z * (v1 * ratio + v2)
    denominator = z / p2 + v2 * ratio + v1
    # The denominator vanishes only where phase 2 is alone (v1 = 0) and p1 = z = 0: p is p2 there.
    alone = np.broadcast_to(p2, denominator.shape).copy()
    mixed: FloatOrArray = np.divide(numerator, denominator, out=alone, where=denominator > 0)[()]
    return mixed


def _shear_comparison(bulk: FloatOrArray, shear: FloatOrArray) -> FloatArray:
    """Return z of the shear modulus: 3/2 of it where incompressible, 4/3 of it at the other end."""
    k, g = np.asarray(bulk, dtype=np.float64), np.asarray(shear, dtype=np.float64)
    return np.asarray(g * ((9 * k + 8 * g) / (6 * (k + 2 * g))))


def _scaled(value: FloatOrArray, factor: float) -> FloatArray:
    return factor * np.asarray(value, dtype=np.float64)


def _check_moduli(
    bulk_1: FloatOrArray, shear_1: FloatOrArray, bulk_2: FloatOrArray, shear_2: FloatOrArray
) -> None:
    _require(np.asarray(bulk_1) > 0, f"bulk_1 = {bulk_1}: must be > 0")
    _check_phases("bulk_1", bulk_1, "bulk_2", bulk_2)
    _check_phases("shear_1", shear_1, "shear_2", shear_2)


def _check_phases(name_1: str, p1: FloatOrArray, name_2: str, p2: FloatOrArray) -> None:
    low, high = np.asarray(p1), np.asarray(p2)
    _require((low >= 0) & np.isfinite(low), f"{name_1} = {p1}: must be >= 0 and finite")
    _require((high > 0) & np.isfinite(high), f"{name_2} = {p2}: must be > 0 and finite")
    _require(high >= low, f"{name_2} = {p2}: must be >= {name_1} = {p1}")


def _require(satisfied: NDArray[np.bool_], message: str) -> None:
    """Raise unless a condition holds everywhere; NaN satisfies no comparison and is refused."""
    if not np.all(satisfied):
        raise ValueError(message)
