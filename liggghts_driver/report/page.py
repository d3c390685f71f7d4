"""The page: everything in one file, so that it opens anywhere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver.prepare import decisions_of
from liggghts_driver.report.environment import page_environment
from liggghts_driver.report.facts import overview, provenance
from liggghts_driver.report.listing import scene_listing
from liggghts_driver.report.tables import comparison_rows, exact_rows, steadiness

if TYPE_CHECKING:
    from collections.abc import Sequence

    from liggghts_driver.case import Case
    from liggghts_driver.report.picture import Picture
    from liggghts_driver.report.snapshots import Snapshots
    from liggghts_driver.results.answer import Answer


@dataclass(frozen=True)
class Headline:
    """A verdict in words, with a mark that needs no colour to be told."""

    word: str
    mark: str
    meaning: str


_HEADLINES = {
    "valid": Headline("Valid", "✓", "This run passed every check."),
    "not_steady": Headline(
        "Not steady",
        "~",
        "The run is sound, but it did not become steady: do not read the means below as steady "
        "values.",
    ),
    "invalid": Headline("Invalid", "✗", "A check failed: do not use the numbers below."),
}


def _capital(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]


def render_page(
    case: Case,
    answer: Answer,
    deck: str,
    figures: Sequence[Picture],
    snapshots: Snapshots,
) -> str:
    """The HTML of a report.

    Parameters
    ----------
    case, answer
        What was run, and what came out.
    deck
        The engine's input.
    figures
        Those that the scene calls for.
    snapshots
        What the engine rendered.
    """
    results = answer.results
    return (
        page_environment()
        .get_template("report.html.j2")
        .render(
            headline=_HEADLINES[answer.verdict],
            results=results,
            accuracy=[_capital(each) for each in results["accuracy"].get("sentences", ())],
            comparison=comparison_rows(results),
            steadiness=steadiness(results),
            exact=exact_rows(results),
            figures={figure.name: figure for figure in figures},
            snapshots=snapshots,
            overview=overview(results),
            effects=decisions_of(case),
            listing=scene_listing(case.scene),
            deck=deck,
            provenance=provenance(results),
        )
    )
