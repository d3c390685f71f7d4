"""Honest statistics of simulated time series: steady part, mean, flow rate, 95 % intervals."""

from liggghts_driver.statistics.correlation import (
    Amplitude,
    MeanEstimate,
    fit_shape,
    mean_estimate,
)
from liggghts_driver.statistics.rate import Rate, SeriesMean, flow_rate, series_mean
from liggghts_driver.statistics.steady import Steady, steady_part, steady_slope
from liggghts_driver.statistics.student import students_half_width

__all__ = [
    "Amplitude",
    "MeanEstimate",
    "Rate",
    "SeriesMean",
    "Steady",
    "fit_shape",
    "flow_rate",
    "mean_estimate",
    "series_mean",
    "steady_part",
    "steady_slope",
    "students_half_width",
]
