"""What if: simulated flow rates beside the law's, where an input of the law was varied in both."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.paper.printed import SECTIONS
from liggghts_driver.paper.stored import NOT_RUN
from liggghts_driver.paper.varied import FRACTION, POROSITY
from liggghts_driver.paper.words import FLOW_UNIT, capital, cell, judge

if TYPE_CHECKING:
    from liggghts_driver.paper.stored import Stored
    from liggghts_driver.paper.varied import Varied


def what_if_answer(stored: Stored) -> list[str]:
    """A sentence for each value of each input that has been simulated."""
    sentences = [
        _beside_the_law(stored, varied, value)
        for varied in (FRACTION, POROSITY)
        for value in sorted(set().union(*(varied.flows(stored, s) for s in SECTIONS)))
    ]
    return sentences or [f"{capital(NOT_RUN)}."]


def _beside_the_law(stored: Stored, varied: Varied, value: float) -> str:
    law_at = varied.estimate(value)
    expected = float(np.asarray(law_at.particle_flow_rate_m3_s))
    outside = "" if law_at.valid else ", where it is said not to hold"
    told = []
    for section in SECTIONS:
        pooled = varied.flows(stored, section).get(value)
        judged = judge(pooled, expected, FLOW_UNIT).words
        told.append(f"{section}, {cell(pooled, FLOW_UNIT)}, {judged}")
    return f"{varied.symbol} = {value:g}, held against the law{outside}: {'; '.join(told)}."
