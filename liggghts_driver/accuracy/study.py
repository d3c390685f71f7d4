"""A study of accuracy as its file has it: settings, what each costs, and how far it errs."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import ConfigDict, Field

from liggghts_driver.scene.accuracy import Settings  # noqa: TC001 - pydantic reads it
from liggghts_driver.scene.fields import Line, Table


class _Part(Table):
    """A table of the file; what it says beyond this is for others to read."""

    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)


class Error(_Part):
    """The relative error of a quantity, by so many packings; null where it is not known."""

    mean: float | None
    ci95: float | None
    replicates: int

    @property
    def reach(self) -> float:
        """How far its 95 % interval reaches from zero; infinite without an interval."""
        if self.mean is None or self.ci95 is None:
            return math.inf
        return abs(self.mean) + self.ci95


class Row(_Part):
    """One way of computing the problem."""

    title: Line
    knob: str
    changes: dict[str, float | str]
    cost_over_reference: float
    errors: dict[str, Error]
    largest_overlap_over_radius: float


class Provenance(_Part):
    """What made the study."""

    command: tuple[Line, ...]
    liggghts_driver: Line


class Study(_Part):
    """All of it."""

    study: Literal["accuracy"]
    title: Line
    problem_sha256: Line
    duration_s: float
    chosen_by: tuple[str, ...] = Field(min_length=1)
    finest: Settings
    settings: tuple[Row, ...]
    provenance: Provenance

    @property
    def replicates(self) -> int:
        """The most packings by which any of its errors is known."""
        found = (error.replicates for row in self.settings for error in row.errors.values())
        return max(found, default=0)
