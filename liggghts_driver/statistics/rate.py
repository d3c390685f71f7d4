"""Flow rates and mean values of the steady part of simulated time series."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from liggghts_driver.statistics.correlation import (
    MINIMUM_SAMPLES,
    FloatArray,
    as_series,
    fit_shape,
    mean_estimate,
)
from liggghts_driver.statistics.steady import steady_part, steady_slope

JITTER = 1e-6
"""How far a sample may be from its place in a uniform sampling, in sampling intervals."""

# If none of a kind of random event was seen, up to -ln(0.05) = 3.0 may have been due (95 %).
_UNSEEN_EVENTS = -float(np.log(0.05))


@dataclass(frozen=True)
class Rate:
    """Flow rate through a section over its steady part."""

    mean_m3_s: float
    ci95_m3_s: float
    """Half width of the 95 % interval; infinite if the series is too short to tell."""
    steady: bool
    steady_from_s: float
    steady_to_s: float
    reason: str
    effective_samples: float


@dataclass(frozen=True)
class SeriesMean:
    """Mean of a quantity over its steady part, in the quantity's own unit."""

    mean: float
    ci95: float
    """Half width of the 95 % interval; infinite if the series is too short to tell."""
    minimum: float
    maximum: float
    steady: bool
    from_s: float
    reason: str
    effective_samples: float
    dropped: int
    """Samples at the start that have no value."""


def flow_rate(
    time_s: npt.ArrayLike,
    volume_m3: npt.ArrayLike,
    quantum_m3: float = 0.0,
    *,
    whole: bool = False,
) -> Rate:
    """Steady flow rate from the accumulated volume of particles past a section.

    The steady part is found by `steady_slope`. Its slope and 95 % interval come from `fit_shape`,
    which is right both for a volume that is a sum of random arrivals (its noise is a random walk,
    and hardly more than the two ends tell the slope) and for a straight line read with noise
    (where all points tell it). The interval excludes the uncertainty of the choice of the part.

    A rate is given for a curve that is not steady too: the mean slope of what comes closest, which
    must not be read as a steady flow rate.

    Parameters
    ----------
    time_s : array_like, shape (n,)
        Times in s, uniform to 1e-6 of their interval.
    volume_m3 : array_like, shape (n,)
        Accumulated volume in m³.
    quantum_m3 : float
        Volume of the smallest particle in m³. The 95 % interval is not made narrower than three
        such particles per length of the steady part: this many may be due although none, or a
        quite regular number, has come. So a blocked section has the rate zero, but not without
        error.
    whole : bool
        Whether the rate is that of the whole series, as it is, and not of its steady part.

    Raises
    ------
    ValueError
        If the series are of unequal length, not one-dimensional, empty or not finite, if the times
        are not uniform, or if the quantum is negative.
    """
    time, volume = as_series(time_s), as_series(volume_m3)
    _require_uniform(time, volume)
    if not 0.0 <= quantum_m3 < np.inf:
        raise ValueError(f"quantum_m3 is a volume, not {quantum_m3}")
    found = steady_slope(volume, whole=whole)
    part, duration = volume[found.start :], float(time[-1] - time[found.start])
    mean, ci95 = _slope(part, duration)
    floor = _UNSEEN_EVENTS * quantum_m3 / duration if duration > 0.0 else 0.0
    return Rate(
        mean_m3_s=mean,
        ci95_m3_s=max(ci95, floor),
        steady=found.steady,
        steady_from_s=float(time[found.start]),
        steady_to_s=float(time[-1]),
        reason=found.reason,
        effective_samples=found.effective_samples,
    )


def series_mean(time_s: npt.ArrayLike, values: npt.ArrayLike) -> SeriesMean:
    """Mean of a fluctuating quantity over its steady part, with an honest 95 % interval.

    The steady part is found by `steady_part`, the interval by `mean_estimate`. The minimum and the
    maximum are those of the steady part. As in `flow_rate`, a series that is not steady still gets
    the mean of what comes closest.

    Parameters
    ----------
    time_s : array_like, shape (n,)
        Times in s, uniform to 1e-6 of their interval.
    values : array_like, shape (n,)
        The quantity in any unit. NaN at the start (no particle flows yet, say) is dropped and
        counted.

    Raises
    ------
    ValueError
        If the series are of unequal length, not one-dimensional, empty or not finite after their
        start, or if the times are not uniform.
    """
    time = as_series(time_s)
    raw = np.asarray(values, dtype=np.float64)
    _require_uniform(time, raw)
    absent = np.isnan(raw)
    dropped = raw.size if absent.all() else int(np.argmin(absent))
    if dropped == raw.size:
        nan = float("nan")
        reason = f"too short: none of the {dropped} samples has a value"
        return SeriesMean(nan, np.inf, nan, nan, False, float(time[-1]), reason, 0.0, dropped)
    series = as_series(raw[dropped:])
    found = steady_part(series)
    part = series[found.start :]
    estimate = mean_estimate(part)
    return SeriesMean(
        mean=estimate.mean,
        ci95=estimate.ci95,
        minimum=float(part.min()),
        maximum=float(part.max()),
        steady=found.steady,
        from_s=float(time[dropped + found.start]),
        reason=found.reason,
        effective_samples=found.effective_samples,
        dropped=dropped,
    )


def _slope(part: FloatArray, duration: float) -> tuple[float, float]:
    """Slope over ``duration`` (s) and the half width of its 95 % interval."""
    if part.size < 2:
        return float("nan"), float("inf")
    if part.size < MINIMUM_SAMPLES:
        return float(part[-1] - part[0]) / duration, float("inf")
    rise = fit_shape(part, np.linspace(0.0, 1.0, part.size))
    return rise.value / duration, rise.half_width / duration


def _require_uniform(time: FloatArray, values: FloatArray) -> None:
    """Refuse times that do not belong to the values, do not grow, or not in equal steps."""
    if values.shape != time.shape:
        raise ValueError(f"{time.size} times do not belong to values of shape {values.shape}")
    if time.size == 1:
        return
    interval = float(time[-1] - time[0]) / (time.size - 1)
    if interval <= 0.0:
        raise ValueError("time does not grow")
    astray = np.abs(time - np.linspace(time[0], time[-1], time.size)) / interval
    worst = int(np.argmax(astray))
    if astray[worst] > JITTER:
        raise ValueError(
            f"time is not uniform: sample {worst}, at {time[worst]:g} s, is {astray[worst]:.3g} "
            "sampling intervals from its place"
        )
