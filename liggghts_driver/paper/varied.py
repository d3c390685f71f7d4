"""Inputs of the law that simulations vary too: the readings that differ in one of them alone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from liggghts_driver.darcy import estimate
from liggghts_driver.paper import catalogue, law
from liggghts_driver.paper.catalogue import CUT_AT_HALF, FIRST, READINGS
from liggghts_driver.paper.pooled import flow, of_reading
from liggghts_driver.paper.printed import MAIN_GRADIENT_PA_M
from liggghts_driver.prediction import darcy_inputs

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from liggghts_driver.darcy import DarcyInputs, Estimate
    from liggghts_driver.paper.catalogue import Reading
    from liggghts_driver.paper.pooled import Pooled
    from liggghts_driver.paper.stored import Stored


@dataclass(frozen=True)
class Varied:
    """An input of the law: its symbol, how it is set, and the reading that has each value."""

    symbol: str
    put: Callable[[DarcyInputs, float], DarcyInputs]
    readings: Mapping[float, Reading]

    def estimate(self, value: float) -> Estimate:
        """The law at 10 Pa/m with this input changed and all others the paper's."""
        return estimate(self.put(darcy_inputs(law.example()), value), MAIN_GRADIENT_PA_M)

    def flows(self, stored: Stored, section: str) -> dict[float, Pooled]:
        """Simulated flow rates [m3/s] by the input's value, as far as they have run."""
        found = {v: flow(of_reading(stored, r), section) for v, r in self.readings.items()}
        return {value: pooled for value, pooled in sorted(found.items()) if pooled is not None}


FRACTION = Varied(
    "v_p",
    lambda inputs, value: replace(inputs, particle_fraction=value),
    {
        0.15: FIRST,
        **{r.values[catalogue.FRACTION]: r for r in READINGS if catalogue.FRACTION in r.values},
    },
)
POROSITY = Varied(
    "v_2",
    lambda inputs, value: replace(inputs, solid_fraction=1.0 - value),
    {0.45: FIRST, 0.50: CUT_AT_HALF},
)
