"""The simulation beside the estimate: ratio, and difference over its standard error."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from scipy.special import ndtri

if TYPE_CHECKING:
    from collections.abc import Mapping

    from liggghts_driver.statistics import Rate, SeriesMean

#: Half width of a 95 % interval over the standard error.
_CI95 = float(ndtri(0.975))


def compare(
    rates: Mapping[str, Rate], velocity: SeriesMean | None, estimate: Mapping[str, Any]
) -> dict[str, Any]:
    """Each simulated quantity over its estimate.

    Parameters
    ----------
    rates
        Particle flow rate through each section.
    velocity
        Mean velocity of the flowing particles, to hold against the pore velocity q / v2.
    estimate
        The Darcy estimate as in ``results.json``; empty result if it does not apply.

    Returns
    -------
    dict
        Per quantity ``simulated``, ``estimated``, ``ratio`` and ``z_score`` (the difference over
        the standard error of the simulation), and ``estimate_valid``: whether the case is inside
        the law's validity.
    """
    if not estimate["applies"]:
        return {}
    flow, pore = estimate["particle_flow_rate_m3_s"], estimate["pore_velocity_m_s"]
    pairs: dict[str, Any] = {
        name: _pair(rate.mean_m3_s, rate.ci95_m3_s, flow) for name, rate in rates.items()
    }
    if velocity is not None:
        pairs["flowing_velocity"] = _pair(velocity.mean, velocity.ci95, pore)
    return {
        "estimate_valid": estimate["valid"],
        "estimate_warnings": estimate["warnings"],
        **pairs,
    }


def _pair(simulated: float, ci95: float, estimated: float) -> dict[str, float | None]:
    error = ci95 / _CI95
    return {
        "simulated": simulated,
        "estimated": estimated,
        "ratio": simulated / estimated if estimated else None,
        "z_score": (simulated - estimated) / error if 0 < error < math.inf else None,
    }
