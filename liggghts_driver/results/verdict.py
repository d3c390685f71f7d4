"""Whether an answer can be trusted: everything that speaks against it, each in one sentence."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.bounds import contact_bounds
from liggghts_driver.effects.drag_law import reynolds_bound
from liggghts_driver.effects.piston import speed_limit_m_s
from liggghts_driver.results.energy import MARGIN_UNDRIVEN, energy_budget
from liggghts_driver.results.series import fastest_piston_m_s

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    import pandas as pd

    from liggghts_driver.case import Case
    from liggghts_driver.statistics import Rate

#: The servo's limit must stay out of reach: beyond this share of it, Newton's law is in doubt.
SHARE_OF_LIMIT = 0.9
#: A steady rate with a wider interval (95 %, over the rate) decides nothing about the law.
_WIDEST_INTERVAL = 0.25
#: Of the fraction of a contact that a step may be: the speed bound is an estimate, and errors go
#: with the step, so that a few contacts with a tenth more of it change no answer. In speed it is
#: a factor of 1.6.
STEP_TOLERANCE = 1.1


@dataclass(frozen=True)
class Verdict:
    """``valid``, ``invalid`` or ``not_steady``, with the reasons."""

    verdict: str
    reasons: tuple[str, ...]


def judge(
    case: Case,
    series: pd.DataFrame,
    rates: Mapping[str, Rate],
    overlap_over_radius: float,
    scale_m3_s: float = 0.0,
) -> Verdict:
    """Judge a complete run.

    Parameters
    ----------
    case
        What was run.
    series
        Its completed series.
    rates
        Flow rate through each section.
    overlap_over_radius
        Largest overlap found, over the smaller radius.
    scale_m3_s
        A flow rate of the size to expect (the estimate), so that the interval of a blocked
        section has something to be compared with; 0 when nothing is known.
    """
    faults = [*_faults(case, series), *_overlap(case, overlap_over_radius)]
    if faults:
        return Verdict("invalid", tuple(faults))
    unsteady = [
        fault
        for name, rate in rates.items()
        if (fault := _unsteady(name, rate, series, scale_m3_s))
    ]
    if unsteady:
        return Verdict("not_steady", tuple(unsteady))
    return Verdict("valid", ())


def _unsteady(name: str, rate: Rate, series: pd.DataFrame, scale_m3_s: float) -> str | None:
    if not rate.steady:
        return f"{name}: {rate.reason}"
    volume = series.get(f"volume_{name}_m3")
    if volume is not None and not volume.any():
        # Steady at nothing is no measurement: it looks alike before the flow and in a block.
        return f"{name}: no particle has passed it; run longer, unless it is blocked"
    scale = max(abs(rate.mean_m3_s), scale_m3_s)
    if rate.ci95_m3_s > _WIDEST_INTERVAL * scale:
        return (
            f"{name}: the flow rate is known to ± {rate.ci95_m3_s / scale:.0%} only; run longer"
            if scale
            else f"{name}: nothing flows, and nothing is known to compare with"
        )
    return None


def _faults(case: Case, series: pd.DataFrame) -> Iterator[str]:
    # A flowing velocity is nan while nothing flows; every other column must be finite.
    numbers = series.drop(columns=["flowing_velocity_m_s"], errors="ignore")
    broken = [str(name) for name in numbers if not np.isfinite(numbers[name]).all()]
    if broken:
        yield f"not a number in: {', '.join(broken)}"
        return
    yield from _contact_step(case, series)
    yield from _energy(case, series)
    yield from _reynolds(case, series)
    yield from _piston(case, series)


def _contact_step(case: Case, series: pd.DataFrame) -> Iterator[str]:
    fastest = float(series["largest_speed_m_s"].max())
    if fastest <= case.speed_bound_m_s:
        return
    limit = STEP_TOLERANCE * contact_step_limit_s(case, fastest)
    if case.time.step_s > limit:
        yield (
            f"a particle reached {fastest:.3g} m/s, {case.speed_bound_m_s:.3g} were expected: at "
            f"that speed the step must be at most {limit:.3g} s, it was {case.time.step_s:.3g} s "
            "(time.step)"
        )


def contact_step_limit_s(case: Case, speed_m_s: float) -> float:
    """The longest step that resolves contacts at some speed; infinite where nothing can touch."""
    bounds = contact_bounds(case.scene, case.layout, case.population, speed_m_s)
    return min((bound.step_s for bound in bounds), default=math.inf)


def _energy(case: Case, series: pd.DataFrame) -> Iterator[str]:
    budget, most = energy_budget(case), float(series["kinetic_energy_j"].max())
    if budget is None:
        return
    if most > budget.limit_j:
        yield f"the particles' kinetic energy reached {most:.3g} J; the limit is {budget}"
    elif budget.undriven and most > MARGIN_UNDRIVEN * budget.items_j["start"]:
        yield (
            f"the particles' kinetic energy reached {most:.3g} J from "
            f"{budget.items_j['start']:.3g} J at the start, and nothing drives them"
        )


def _reynolds(case: Case, series: pd.DataFrame) -> Iterator[str]:
    if "largest_reynolds" not in series:
        return
    reached, bound = float(series["largest_reynolds"].max()), reynolds_bound(case)
    if reached > bound:
        yield f"Re reached {reached:.4g}; the deck's drag law ends at {bound:g}"


def _piston(case: Case, series: pd.DataFrame) -> Iterator[str]:
    if "piston_x_m" not in series:
        return
    fastest = fastest_piston_m_s(series)
    limit = speed_limit_m_s(case)
    if fastest > SHARE_OF_LIMIT * limit:
        yield f"the piston reached {fastest:.3g} m/s; the servo's limit is {limit:.3g} m/s"
    depth, grain = piston_in_grains(case, float(series["piston_x_m"].max()))
    if depth > case.scene.contact.largest_overlap:
        yield (
            f"the piston overlapped grain {grain} by {depth:.3g} of its radius; "
            f"contact.largest_overlap allows {case.scene.contact.largest_overlap:g}"
        )


def piston_in_grains(case: Case, piston_x_m: float) -> tuple[float, int]:
    """How deep the piston stands in a fixed grain, over the grain's radius; and the grain's id."""
    population = case.population
    if not population.grains:
        return 0.0, 0
    centres, radii = (a[population.particles :] for a in (population.centres_m, population.radii_m))
    low, high = (np.array(corner[1:]) for corner in (case.layout.low, case.layout.high))
    # From the piston's rectangle; one whose centre it has passed is deeper by the way since.
    beside = np.maximum(np.maximum(low - centres[:, 1:], centres[:, 1:] - high), 0.0)
    ahead = centres[:, 0] - piston_x_m
    gaps = np.linalg.norm(np.column_stack([np.maximum(ahead, 0.0), beside]), axis=1)
    depths = np.where(gaps < radii, radii - gaps + np.maximum(-ahead, 0.0), 0.0) / radii
    deepest = int(depths.argmax())
    return float(depths[deepest]), population.particles + deepest + 1


def _overlap(case: Case, overlap_over_radius: float) -> Iterator[str]:
    allowed = case.scene.contact.largest_overlap
    if not overlap_over_radius <= allowed:  # so that nan is a fault too
        yield (
            f"a contact overlapped by {overlap_over_radius:.3g} of the smaller radius; "
            f"contact.largest_overlap allows {allowed:g}"
        )
