"""The cheapest settings whose errors, intervals and all, are within a tolerance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from liggghts_driver.accuracy.settings import OVERLAP
from liggghts_driver.scene.accuracy import NUMERICAL

if TYPE_CHECKING:
    from collections.abc import Mapping

    from liggghts_driver.accuracy.study import Row, Study

#: A smaller section is another sample, and a window is no setting.
_KNOBS = ("reference", "step", "drag", "stiffness", "together")
#: Largest overlap allowed, over the largest that the study met: other packings meet others.
_MARGIN = 1.5


@dataclass(frozen=True)
class Choice:
    """Settings of a study, and what is known of them; errors are relative to the finest's.

    Attributes
    ----------
    title
        As the study calls them.
    settings
        Dotted key of the scene to its value; what differs from the finest and what does not.
    finest
        Whether they are the finest themselves.
    cost_over_reference
        Time over that of the finest.
    error, reach
        The largest mean error of the quantities that settings are chosen by, and how far the 95 %
        intervals of these errors reach.
    replicates
        Packings by which the errors are known.
    overlap
        The largest of a contact, over the smaller radius.
    """

    title: str
    settings: Mapping[str, Any]
    finest: bool
    cost_over_reference: float
    error: float
    reach: float
    replicates: int
    overlap: float

    def settings_for(self, largest_overlap: float) -> dict[str, Any]:
        """The settings for a scene that allows so large an overlap, over the smaller radius.

        Where contacts of these settings overlap further, that is allowed too, with a margin of a
        half: it is part of the error that was measured.
        """
        needed = float(f"{_MARGIN * self.overlap:.3g}")
        allowed = {OVERLAP: needed} if needed > largest_overlap else {}
        return {**self.settings, **allowed}


def choose(study: Study, tolerance: float) -> Choice | None:
    """The cheapest settings of a study whose errors are within a tolerance.

    The 95 % interval of every quantity by which settings are chosen must be within; what is known
    by one packing has none. The finest settings are within by definition.

    Parameters
    ----------
    study
        The study.
    tolerance
        Relative error.

    Returns
    -------
    Choice | None
        None if the study has no reference, and nothing else is within either.
    """
    choices = [made for row in study.settings if (made := _choice(study, row)) is not None]
    within = [made for made in choices if made.reach <= tolerance]
    return min(within, key=lambda made: (made.cost_over_reference, made.reach), default=None)


def _choice(study: Study, row: Row) -> Choice | None:
    """A row as a choice; None if it cannot be chosen, or its errors are not all known."""
    if row.knob not in _KNOBS or not set(row.changes) <= set(NUMERICAL):
        return None
    errors = [row.errors[name] for name in study.chosen_by if name in row.errors]
    finest = row.knob == "reference"
    if not finest and len(errors) < len(study.chosen_by):
        return None
    return Choice(
        title=row.title,
        settings={**study.finest, **row.changes},
        finest=finest,
        cost_over_reference=row.cost_over_reference,
        error=0.0 if finest else max(abs(error.mean or 0.0) for error in errors),
        reach=0.0 if finest else max(error.reach for error in errors),
        replicates=min((error.replicates for error in errors), default=1),
        overlap=row.largest_overlap_over_radius,
    )
