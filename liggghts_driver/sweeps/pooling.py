"""Replicates of a combination of axis values as one row: mean, interval, and where it varies from.

The mean of one run has an error, since the run is short: variance *within* a run, known from the
interval that the run itself gives. Runs with other seeds have other packings: variance *between*
them. With n replicates, sample variance s² of their means and mean W of their own variances, the
one-way random-effects model splits it by moments: within = W, between = max(0, s² − W).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from scipy import stats

from liggghts_driver.errors import DriverError
from liggghts_driver.prediction import steady_estimate
from liggghts_driver.sweeps.table import axis_column, results_in

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from liggghts_driver.darcy import Estimate
    from liggghts_driver.sweeps.plan import Plan
    from liggghts_driver.sweeps.table import Result

    #: The Darcy estimate at some values of the axes; None where the law says nothing.
    Theory = Callable[[Mapping[str, Any]], Estimate | None]

#: Half width of a 95 % interval over the standard error, as in a run's z-score.
_CI95 = float(stats.norm.ppf(0.975))
#: What is counted of a combination's replicates: each is one of these.
OUTCOMES = ("valid", "not_steady", "invalid", "failed", "unfinished")


def pool(table: pd.DataFrame, axes: Sequence[str]) -> pd.DataFrame:
    """One row for each combination of axis values, in the order in which they come.

    The mean is that of the valid replicates. Where none is valid it is that of those that did not
    become steady, so that the two are never mixed: ``mean_of`` says which (``valid``,
    ``not_steady``, or ``none``). Invalid runs enter no mean.

    Parameters
    ----------
    table
        Of all points, as ``points_table`` makes it.
    axes
        Keys of the axes; none for a sweep of replicates alone.

    Returns
    -------
    DataFrame
        The axes; the number of ``replicates``, of those ``done``, and of each outcome;
        ``mean_of``; for each result ``<result>`` (the mean), ``<result>_ci95`` (half width of its
        95 % interval), ``<result>_interval_from``, ``<result>_replicates`` (how many it rests on),
        ``<result>_variance_within`` and ``<result>_variance_between``, each with its unit; what
        theory says and the ratio to it; the largest overlap; the cost.

        An interval from ``replicates`` is Student's t for n − 1 times the root of
        (within + between)/n: never less than what the errors of the runs leave. One from
        ``one_run`` is that of the only run: of its time alone, not of its packing. Both need an
        error to be known; else it is ``none``.
    """
    keys = [axis_column(key) for key in axes]
    table = table.drop_duplicates([*keys, "run"], ignore_index=True)  # points may share a run
    row = _combination(table, keys)
    outcome = _outcomes(table)
    counts = {name: (outcome == name).groupby(row).sum() for name in OUTCOMES}
    pooled = table.loc[~row.duplicated(), keys].reset_index(drop=True)
    pooled["replicates"] = row.groupby(row).size()
    pooled["done"] = counts["valid"] + counts["not_steady"] + counts["invalid"]
    pooled = pooled.assign(**counts)
    best = pd.Series("none", index=pooled.index, dtype=object)
    best = best.mask(counts["not_steady"] > 0, "not_steady").mask(counts["valid"] > 0, "valid")
    pooled["mean_of"] = best.astype("string")
    enters = outcome == best.loc[row].to_numpy()
    results = results_in(table.columns)
    names = dict.fromkeys(result.theory for result in results)
    names |= {"estimate_valid": None} if "estimate_valid" in table else {}
    theory = {name: table[name].groupby(row).first() for name in names}
    pooled = pooled.assign(**theory)
    parts = [_pool_one(table, result, enters, row) for result in results]
    compared = [
        _ratio(result, pooled[result.theory], part)
        for result, part in zip(results, parts, strict=True)
    ]
    return pd.concat([pooled, *parts, *compared, _cost(table, row)], axis=1)


def _combination(table: pd.DataFrame, keys: list[str]) -> pd.Series[int]:
    """The number of the combination that each point belongs to, from 0."""
    if not keys:
        return pd.Series(0, index=table.index)
    return table.groupby(keys, sort=False, dropna=False).ngroup()


def _outcomes(table: pd.DataFrame) -> pd.Series[str]:
    """One of ``OUTCOMES`` for each point."""
    state, verdict = table["state"].astype(object), table["verdict"].astype(object)
    other = np.where(state == "failed", "failed", "unfinished")
    return verdict.where(state == "done", pd.Series(other, index=table.index))


def _pool_one(
    table: pd.DataFrame, result: Result, enters: pd.Series[bool], row: pd.Series[int]
) -> pd.DataFrame:
    """Mean, interval and variances of one result, a row for each combination."""
    values = table[result.column].where(enters)
    groups = values.groupby(row)
    count, mean, squares = groups.count(), groups.mean(), groups.var(ddof=1)
    own = _own_errors(table, result).where(values.notna()).groupby(row)
    within = (own.mean()).where(own.count() == count)  # else the split is not known
    between = (squares - within).clip(lower=0.0)
    interval = _interval(count, within, between, squares)
    source = pd.Series("one_run", index=count.index).mask(count > 1, "replicates")
    source = source.mask(~np.isfinite(interval), "none")
    return pd.DataFrame(
        {
            result.column: mean,
            result.part("ci95"): interval,
            f"{result.stem}_interval_from": source.astype("string"),
            f"{result.stem}_replicates": count,
            result.variance("within"): within,
            result.variance("between"): between,
        }
    )


def _ratio(result: Result, theory: pd.Series[float], part: pd.DataFrame) -> pd.DataFrame:
    """The result over what theory says, with its interval."""
    scale = theory.where(theory != 0.0)
    name = f"ratio_{result.name}"
    return pd.DataFrame(
        {
            name: part[result.column] / scale,
            f"{name}_ci95": part[result.part("ci95")] / scale.abs(),
        }
    )


def _own_errors(table: pd.DataFrame, result: Result) -> pd.Series[float]:
    """The variance of each run's mean; not known of what a run gives without an interval."""
    if result.part("ci95") not in table:
        return pd.Series(np.nan, index=table.index)
    return (table[result.part("ci95")] / _CI95) ** 2


def _interval(
    count: pd.Series[int],
    within: pd.Series[float],
    between: pd.Series[float],
    squares: pd.Series[float],
) -> pd.Series[float]:
    """Half width of the 95 % interval of a mean over replicates, or of the only run."""
    total = (within + between).fillna(squares)
    student = pd.Series(stats.t.ppf(0.975, np.maximum(count - 1, 1)), index=count.index)
    error = (total / count) ** 0.5
    return (student * error).where(count > 1, _CI95 * within**0.5)


def _cost(table: pd.DataFrame, row: pd.Series[int]) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "max_overlap_over_radius": table["max_overlap_over_radius"].groupby(row).max(),
            "wall_mean_s": table["wall_s"].where(table["core_s"].notna()).groupby(row).mean(),
            "core_sum_s": table["core_s"].groupby(row).sum(),
        }
    )


def single_runs(points: pd.DataFrame, pooled: pd.DataFrame) -> pd.DataFrame:
    """The points behind means over replicates, none where a mean is one run; not invalid ones."""
    runs = points[points["verdict"].isin(["valid", "not_steady"])]
    return runs if pooled["replicates"].max() > 1 else runs[:0]


def varying_axes(pooled: pd.DataFrame, axes: Sequence[str]) -> tuple[str, ...]:
    """Keys of the axes that have more than one value."""
    return tuple(key for key in axes if len(pooled[axis_column(key)].unique()) > 1)


def most_values_first(pooled: pd.DataFrame, axes: Sequence[str]) -> list[str]:
    """Keys of the axes: numbers before words, and many values before few."""
    columns = {key: pooled[axis_column(key)] for key in axes}
    return sorted(axes, key=lambda k: (columns[k].dtype.kind not in "if", -columns[k].nunique()))


def free_axes(pooled: pd.DataFrame, axes: Sequence[str]) -> tuple[str, ...]:
    """Keys of the axes that vary by themselves.

    An axis that has one value only, or rises or falls with another, has no direction of its own:
    a longer run at each lower gradient, say.
    """
    free: list[str] = []
    for key in varying_axes(pooled, axes):
        column = axis_column(key)
        if not any(_follows(pooled, axis_column(other), column) for other in free):
            free.append(key)
    return tuple(free)


def _follows(pooled: pd.DataFrame, leader: str, column: str) -> bool:
    pairs = pooled[[leader, column]].drop_duplicates().sort_values(leader)
    if not pairs[leader].is_unique:
        return False
    values = pairs[column]
    numbers = pairs.dtypes.map(lambda dtype: dtype.kind in "if").all()
    return bool(not numbers or values.is_monotonic_increasing or values.is_monotonic_decreasing)


def state_of(pooled: pd.DataFrame, column: str) -> pd.Series[str]:
    """What each combination has of a result.

    ``valid`` or ``not_steady`` with a value; without one ``failed``, ``invalid`` or ``unfinished``
    if any of its replicates is, in this order; ``nothing`` if they are sound and give no value.
    """
    state = pooled["mean_of"].astype(object).where(pooled[column].notna(), "nothing")
    for name in ("unfinished", "invalid", "failed"):
        state = state.mask((pooled["mean_of"] == "none") & (pooled[name] > 0), name)
    return state


def main_effect(
    pooled: pd.DataFrame, column: str, axis: str, others: Sequence[str]
) -> pd.Series[float]:
    """Mean of a result at each value of one axis, over the combinations of the others.

    Only those combinations of the others enter that have a result at every value of the axis, so
    that all means are over the same; without any there is no mean.

    Parameters
    ----------
    pooled
        The combinations.
    column, axis, others
        Columns of the result, of the axis, and of all other axes.
    """
    known = pooled[pooled[column].notna()]
    values = known.groupby(list(others), sort=False, dropna=False)[axis].transform("nunique")
    return known[values == pooled[axis].nunique()].groupby(axis, sort=True)[column].mean()


def theory_of(plan: Plan) -> Theory:
    """The Darcy estimate at any values of the axes; None where the law says nothing."""
    first = plan.points[0]

    def at(values: Mapping[str, Any]) -> Estimate | None:
        place = {**first.values, **values}  # noqa: PD011 - not those of a table
        try:
            return steady_estimate(plan.scene(replace(first, values=place)))
        except (DriverError, ValueError):  # no such scene, or no law for it
            return None

    return at
