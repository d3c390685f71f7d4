"""The study of effects as one table: a row for the whole scene, one for each effect left out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pandas as pd

if TYPE_CHECKING:
    from collections.abc import Mapping


def table_of(results: Mapping[str, Any]) -> pd.DataFrame:
    """What ``effects.csv`` holds; changes and shares are fractions, absent numbers are empty.

    For each observable its mean over the replicates, under its own name, and the relative change
    with the half-width of its 95 % interval.
    """
    return pd.DataFrame([_row(variant) for variant in results["variants"]])


def _row(variant: Mapping[str, Any]) -> dict[str, Any]:
    estimate, time = variant["estimate"] or {}, variant["time_ratio"] or {}
    row = {
        "variant": variant["name"],
        "left_out": " ".join(variant["left_out"]),
        "finished": variant["finished"],
        "failed": variant["failed"],
        "invalid": variant["invalid"],
        "number": estimate.get("number"),
        "value": estimate.get("value"),
        "estimated_motion_share": estimate.get("motion_share"),
        "estimated_time_share": estimate.get("time_share"),
        "time_s_per_simulated_s": variant["time_s_per_simulated_s"],
        "time_ratio_median": time.get("median"),
        "time_ratio_smallest": time.get("smallest"),
        "time_ratio_largest": time.get("largest"),
        "steps_ratio": (variant["steps_ratio"] or {}).get("median"),
    }
    for observable in variant["observables"]:
        name, change = observable["name"], observable["change"] or {}
        row[name] = observable["mean"]
        row[f"relative_change_of_{name}"] = change.get("mean")
        row[f"relative_change_ci95_of_{name}"] = change.get("ci95")
    return row
