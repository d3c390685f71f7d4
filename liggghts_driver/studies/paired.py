"""Differences between two variants that were run with the same seeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.statistics import students_half_width

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True)
class Change:
    """A relative change, the mean over replicates.

    ``ci95`` is the half-width of its 95 % interval; None with one replicate, which has none.
    """

    mean: float
    ci95: float | None
    replicates: int


@dataclass(frozen=True)
class Ratio:
    """Median, smallest and largest of a ratio over replicates."""

    median: float
    smallest: float
    largest: float
    replicates: int


def ratios(variant: Mapping[int, float], base: Mapping[int, float]) -> list[float]:
    """Variant over base by seed, of the seeds that both have and where the base is not zero."""
    return [variant[seed] / base[seed] for seed in sorted(variant) if base.get(seed, 0.0) != 0.0]


def paired_change(variant: Mapping[int, float], base: Mapping[int, float]) -> Change | None:
    """Mean of variant / base - 1 with Student's interval over the replicates; None without a pair.

    Parameters
    ----------
    variant, base
        One value for each seed.
    """
    changes = np.array(ratios(variant, base)) - 1.0
    if not len(changes):
        return None
    return Change(float(changes.mean()), students_half_width(changes), len(changes))


def paired_ratio(variant: Mapping[int, float], base: Mapping[int, float]) -> Ratio | None:
    """Variant over base: median and range over the replicates; None without a pair.

    The median, since a machine that is busy for a while makes single runs slow, never fast.
    """
    found = ratios(variant, base)
    if not found:
        return None
    return Ratio(float(np.median(found)), min(found), max(found), len(found))
