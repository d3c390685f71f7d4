"""The second line of defence: a run is watched while the engine computes it."""

from liggghts_driver.watch.finding import Finding, recorded_finding
from liggghts_driver.watch.look import Watch

__all__ = ["Finding", "Watch", "recorded_finding"]
