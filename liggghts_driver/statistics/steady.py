"""Where the steady part of a series starts, and whether it deserves the name.

The start is found by MSER-5, which throws away as much of the beginning as makes the mean of the
rest best known. That always finds something, so the rest must then pass two tests: no drift, and
enough independent samples. The tests refuse what they can see. A drift that is small beside the
noise passes; the reason therefore states how large a drift was found, and how well it is known.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from liggghts_driver.statistics.correlation import (
    MINIMUM_SAMPLES,
    Amplitude,
    FloatArray,
    as_series,
    fit_shape,
    mean_estimate,
)

BATCH = 5
"""Samples in a batch of MSER-5."""

MARGIN = 0.5
"""A start found by MSER-5 is moved on by this share of what it drops."""

MINIMUM_REST = 0.5
"""Smallest share of the series in a steady part that fluctuates."""

MINIMUM_CONSTANT_REST = 1.0 / 3.0
"""Smallest share of the series in a steady part that is exactly constant."""

MINIMUM_EFFECTIVE_SAMPLES = 10.0
"""Fewest effective samples in a steady part; with fewer, drift cannot be told from slow noise."""

NEGLIGIBLE = 0.01
"""A change by less than this share of the mean is no drift, however clearly it is seen."""

# Two drift tests share a false alarm rate of 5 % (Bonferroni).
_CONFIDENCE = 0.975


@dataclass(frozen=True)
class Steady:
    """The verdict on a series."""

    steady: bool
    start: int
    """Index of the first sample of the part that is steady, or comes closest to it."""
    reason: str
    effective_samples: float
    """Of the part from ``start`` on."""


def steady_part(values: npt.ArrayLike) -> Steady:
    """Find the steady part of a series that fluctuates about a level.

    The rules, in this order:

    1. Fewer than 20 samples are too short.
    2. The start is that of MSER-5 (`truncation_point`); at least half of the series is kept, or a
       third if that is exactly constant.
    3. The rest drifts if a straight line through it rises or falls, or if the levels of its halves
       differ, beyond what its noise, allowing for correlation (`fit_shape`), explains at the
       97.5 % level each (5 % together), and by more than 1 % of its mean.
    4. The rest is too short if it holds fewer than 10 effective samples (`mean_estimate`), unless
       all of it lies within 1 % of its mean.

    Of simulated steady series, white or correlated, 2 to 5 % are called drifting.

    Parameters
    ----------
    values : array_like, shape (n,)
        Uniformly sampled, finite.

    Raises
    ------
    ValueError
        If the values are not a one-dimensional, finite, non-empty series.
    """
    series = as_series(values)
    if series.size < MINIMUM_SAMPLES:
        return _too_few(series.size, MINIMUM_SAMPLES)
    start = truncation_point(series)
    rest = series[start:]
    position = (np.arange(rest.size) + 0.5) / rest.size
    line = fit_shape(rest, position, _CONFIDENCE, stationary=True)
    step = np.heaviside(position - 0.5, 0.5)
    halves = fit_shape(rest, step, _CONFIDENCE, stationary=True)
    return _verdict(rest, start, line, halves)


def steady_slope(values: npt.ArrayLike, *, whole: bool = False) -> Steady:
    """Find the part of an accumulated curve in which its slope is steady.

    The same rules as in `steady_part`, applied to the slope: MSER-5 and the effective samples use
    the increments from sample to sample, and the drift tests ask whether the curve bends (a
    parabola) or has a kink in the middle. Asking the curve, not its increments, keeps the tests
    sharp where the noise lies in the reading of the curve. Of simulated steady curves, at most 7 %
    are called drifting.

    Parameters
    ----------
    values : array_like, shape (n,)
        Height of the curve, uniformly sampled, finite.
    whole : bool
        Whether all of the series is judged, as it is, and not the part that is best known.

    Raises
    ------
    ValueError
        If the values are not a one-dimensional, finite, non-empty series.
    """
    curve = as_series(values)
    if curve.size <= MINIMUM_SAMPLES:
        return _too_few(curve.size, MINIMUM_SAMPLES + 1)
    increments = np.diff(curve)
    start = 0 if whole else truncation_point(increments)
    rest = curve[start:]
    length = rest.size - 1
    position = np.arange(rest.size) / length
    # Scaled such that the amplitude is the change of the increment per sample.
    parabola = 0.5 * length * position**2
    kink = length * np.maximum(position - 0.5, 0.0)
    bend = fit_shape(rest, np.array([position, parabola]), _CONFIDENCE)
    halves = fit_shape(rest, np.array([position, kink]), _CONFIDENCE)
    return _verdict(increments[start:], start, bend, halves)


def truncation_point(series: FloatArray) -> int:
    """Index at which to start, by the marginal standard error rule in batches of five (MSER-5).

    The series is averaged in batches of 5, counted from its end. Of all starts that leave m
    batches, the one with the smallest (sum of squared deviations from their mean)/m² is taken
    (White, Simulation 69, 1997; White, Cobb and Spratt, Winter Simulation Conference 2000). The
    earliest wins a tie. This balances what is left of a transient against the noise, so that of a
    gradual transient a bias as large as the error remains; a further half of what is dropped is
    therefore dropped too, which makes it small. At least half of the series (the usual limit) and
    20 samples are kept in the end, for two reasons: the rule is fooled by the chance agreement of a
    few last batches, and in the last stretch of a slow decay no test finds the drift. Samples
    before the first whole batch stay with it.

    An end that is exactly constant, such as that of a blocked section, agrees by more than chance:
    it is taken from its first sample on if it is at least a third of the series and 20 samples.

    Parameters
    ----------
    series : ndarray, shape (n,)
        Uniformly sampled, n >= 20.
    """
    changes = np.flatnonzero(series != series[-1])
    constant_from = int(changes[-1]) + 1 if changes.size else 0
    if series.size - constant_from >= _fewest(series.size, MINIMUM_CONSTANT_REST):
        return constant_from
    batches = series.size // BATCH
    spare = series.size - batches * BATCH
    # Deviations from the last batch keep a large common level out of the differences of squares.
    means = series[spare:].reshape(batches, BATCH).mean(axis=1)
    backwards = (means - means[-1])[::-1]
    left = np.arange(1, batches + 1)
    squares = np.cumsum(backwards**2) - np.cumsum(backwards) ** 2 / left
    fewest = int(np.ceil(_fewest(series.size, MINIMUM_REST) / BATCH))
    statistic = (squares / left**2)[fewest - 1 :]
    dropped = int((1.0 + MARGIN) * int(np.argmin(statistic[::-1])))
    dropped = min(dropped, batches - fewest)
    return 0 if dropped == 0 else spare + dropped * BATCH


def _fewest(samples: int, share: float) -> float:
    return max(float(MINIMUM_SAMPLES), share * samples)


def _too_few(samples: int, needed: int) -> Steady:
    return Steady(
        steady=False,
        start=0,
        reason=f"too short: {samples} samples, at least {needed} are needed",
        effective_samples=float(samples),
    )


def _verdict(rest: FloatArray, start: int, gradual: Amplitude, halves: Amplitude) -> Steady:
    """Judge the kept part from its two drift tests and its effective samples."""
    estimate = mean_estimate(rest)
    mean, effective = estimate.mean, estimate.effective_samples
    drift = f"changes by {_relative(gradual, mean)} from start to end"
    apart = f"differs by {_relative(halves, mean)} between its halves"
    if _is_drift(gradual, mean):
        return Steady(False, start, f"drifts: {drift}", effective)
    if _is_drift(halves, mean):
        return Steady(False, start, f"drifts: {apart}", effective)
    level = bool(np.abs(rest - mean).max() <= NEGLIGIBLE * abs(mean))
    if effective < MINIMUM_EFFECTIVE_SAMPLES and not level:
        few = f"{effective:.1f} effective samples, {MINIMUM_EFFECTIVE_SAMPLES:.0f} are needed"
        return Steady(False, start, f"too short: {few}", effective)
    return Steady(True, start, f"no drift: {drift}, {apart}", effective)


def _is_drift(change: Amplitude, mean: float) -> bool:
    return abs(change.value) > max(change.half_width, NEGLIGIBLE * abs(mean))


def _relative(change: Amplitude, mean: float) -> str:
    """Write a change as a share of the mean, or as it is where the mean is lost in its error."""
    if abs(mean) <= change.half_width:
        return f"{change.value:.3g} ± {change.half_width:.2g}"
    return f"{change.value / abs(mean):+.1%} ± {change.half_width / abs(mean):.1%}"
