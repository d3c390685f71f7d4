"""The page: everything in one file, so that it opens anywhere."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import TYPE_CHECKING

import jinja2

from liggghts_driver.prepare import decisions_of
from liggghts_driver.report.facts import overview, provenance
from liggghts_driver.report.listing import scene_listing
from liggghts_driver.report.numbers import number
from liggghts_driver.report.tables import comparison_rows, exact_rows, steadiness
from liggghts_driver.resources import templates_dir

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
        _environment()
        .get_template("report.html.j2")
        .render(
            headline=_HEADLINES[answer.verdict],
            results=results,
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


def _environment() -> jinja2.Environment:
    """Every text is escaped, every unknown name is an error."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(templates_dir()),
        undefined=jinja2.StrictUndefined,
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"data_uri": _data_uri, "number": number}
    return environment


def _data_uri(picture: Picture) -> str:
    return "data:image/png;base64," + base64.b64encode(picture.png).decode("ascii")
