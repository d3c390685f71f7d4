"""Write the report of a run: the page, and its pictures beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from liggghts_driver.outputs import write_bytes, write_text
from liggghts_driver.report.figures import draw_figures
from liggghts_driver.report.page import render_page
from liggghts_driver.report.snapshots import snapshots

if TYPE_CHECKING:
    from liggghts_driver.case import Case
    from liggghts_driver.results.answer import Answer
    from liggghts_driver.rundir import RunDirectory


def write_report(case: Case, answer: Answer, directory: RunDirectory) -> None:
    """Write ``report.html`` and ``figures/*.png`` into the directory of a finished run.

    Raises
    ------
    ParseError
        If a snapshot of the engine cannot be read.
    """
    figures = draw_figures(case, answer)
    seen = snapshots(case, answer, directory)
    for picture in (*figures, *seen.pictures):
        write_bytes(directory.figures / f"{picture.name}.png", picture.png)
    deck = directory.deck.read_text(encoding="utf-8")
    write_text(directory.report, render_page(case, answer, deck, figures, seen))
