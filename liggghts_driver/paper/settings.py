"""The numerical settings of the runs, and what they err by beside the paper's own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from liggghts_driver.paper.catalogue import SETTINGS, sweep_file
from liggghts_driver.paper.changes import change_of, change_words
from liggghts_driver.paper.printed import SECTIONS
from liggghts_driver.paper.stored import NOT_RUN
from liggghts_driver.paper.words import SETTINGS_ERROR, capital, counted, listed
from liggghts_driver.report.numbers import number

if TYPE_CHECKING:
    from collections.abc import Iterable

    from liggghts_driver.paper.stored import Stored, SweepResults
    from liggghts_driver.studies.paired import Change


def cheaper_sweeps(stored: Stored) -> list[SweepResults]:
    """The sweeps with our settings; the other one has the paper's."""
    return [sweep for name, sweep in stored.sweeps.items() if name != SETTINGS.sweep]


def shared_settings(stored: Stored) -> list[str]:
    """What the cheaper sweeps have in common, as TOML would have it."""
    several = [dict(sweep.settings) for sweep in cheaper_sweeps(stored)]
    shared = several[0].items() if several else ()
    return [
        f"{key} = {value}"
        for key, value in shared
        if all(each.get(key) == value for each in several)
    ]


def settings_answer(stored: Stored) -> str:
    """What the paper's own step and stiffness change, packing by packing."""
    changes = {name: change_of(stored, SETTINGS, name) for name in SECTIONS}
    known = {name: change for name, change in changes.items() if change is not None}
    file = f"`cases/paper/{sweep_file(SETTINGS.sweep).name}`"
    if not known:
        return f"What the paper's own step and stiffness change ({file}): {NOT_RUN}."
    told = [f"past the {name} by {change_words(change)}" for name, change in known.items()]
    packings = counted(max(change.replicates for change in known.values()), "packing")
    return (
        f"The paper's own step and stiffness, in the same {packings} ({file}), change the "
        f"flow rate {listed(told)}. {capital(_beside_what_is_allowed(known.values()))}."
    )


def _beside_what_is_allowed(changes: Iterable[Change]) -> str:
    """Whether judgements allow for as much as was measured."""
    allowed = f"the {number(100.0 * SETTINGS_ERROR, 1)} % that judgements on this page allow for"
    reach = [(abs(c.mean), c.ci95) for c in changes]
    if any(half is None for _, half in reach):
        return f"one packing does not tell whether that is within {allowed}"
    if all(mean + (half or 0.0) <= SETTINGS_ERROR for mean, half in reach):
        return f"that is within {allowed}, intervals and all"
    if any(mean - (half or 0.0) > SETTINGS_ERROR for mean, half in reach):
        return f"that is more than {allowed}"
    return f"these packings do not tell whether that is within {allowed}"
