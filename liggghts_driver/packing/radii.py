"""Radii that follow a truncated Gaussian distribution."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtr, ndtri

from liggghts_driver.errors import PackingError

if TYPE_CHECKING:
    from numpy.typing import NDArray

DEFAULT_TRUNCATION = 3.0


def largest_radius(mean_m: float, deviation_m: float, truncation: float) -> float:
    """Return the upper end, in metres, of the interval that holds all radii.

    Raises
    ------
    PackingError
        If the three numbers do not describe a distribution of positive radii.
    """
    if not (math.isfinite(mean_m) and mean_m > 0.0):
        raise PackingError(f"the mean radius must be a positive length, not {mean_m:g} m")
    if not (math.isfinite(deviation_m) and deviation_m >= 0.0):
        raise PackingError(f"the deviation of the radius cannot be {deviation_m:g} m")
    if not (math.isfinite(truncation) and truncation > 0.0):
        raise PackingError(f"the truncation must be a positive number, not {truncation:g}")
    if mean_m <= truncation * deviation_m:
        raise PackingError(
            f"a mean radius of {mean_m:g} m less {truncation:g} deviations of {deviation_m:g} m "
            "leaves no positive radius: lower the deviation or the truncation"
        )
    return mean_m + truncation * deviation_m


def sample_radii(
    mean_m: float,
    deviation_m: float,
    count: int,
    rng: np.random.Generator,
    truncation: float = DEFAULT_TRUNCATION,
) -> NDArray[np.float64]:
    """Draw independent radii from a truncated Gaussian, by inverting its distribution function.

    Parameters
    ----------
    mean_m, deviation_m
        Mean and standard deviation of the Gaussian before truncation, in metres. A deviation of
        zero gives equal radii.
    count
        How many radii.
    rng
        Source of randomness.
    truncation
        Every radius lies within this many deviations of the mean.

    Returns
    -------
    NDArray[np.float64]
        Radii, shape (count,), in metres.

    Raises
    ------
    PackingError
        If the distribution could give a radius that is not positive, or ``count`` is below one.
    """
    largest_radius(mean_m, deviation_m, truncation)
    if count < 1:
        raise PackingError(f"at least one sphere is needed, not {count}")
    below = float(ndtr(-truncation))
    scores = ndtri(rng.uniform(below, 1.0 - below, count))
    # Rounding in ndtri can pass the ends by a hair.
    radii: NDArray[np.float64] = mean_m + deviation_m * np.clip(scores, -truncation, truncation)
    return radii


def mean_sphere_volume(
    mean_m: float, deviation_m: float, truncation: float = DEFAULT_TRUNCATION
) -> float:
    """Return the expected volume, in cubic metres, of one sphere of the distribution.

    With z the truncated standard normal variable, odd moments vanish and
    E[r^3] = mean^3 + 3 mean deviation^2 E[z^2], where E[z^2] = 1 - 2 t phi(t) / (2 Phi(t) - 1)
    for a truncation t.

    Raises
    ------
    PackingError
        If the distribution could give a radius that is not positive.
    """
    largest_radius(mean_m, deviation_m, truncation)
    density = math.exp(-0.5 * truncation**2) / math.sqrt(2.0 * math.pi)
    variance = 1.0 - 2.0 * truncation * density / math.erf(truncation / math.sqrt(2.0))
    return 4.0 / 3.0 * math.pi * (mean_m**3 + 3.0 * mean_m * deviation_m**2 * variance)
