"""Everything that the page consists of: stored results, figures, and the page itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver.paper.collect import collect
from liggghts_driver.paper.figures import draw_figures
from liggghts_driver.paper.page import render_page
from liggghts_driver.paper.stored import read_stored, write_stored
from liggghts_driver.rundir import write_text

if TYPE_CHECKING:
    from pathlib import Path

    from liggghts_driver.paper.stored import Stored


@dataclass(frozen=True)
class Written:
    """The results, and the files that tell of them."""

    stored: Stored
    files: tuple[Path, ...]


def results_file(docs: Path) -> Path:
    """The stored results, in a folder of documentation."""
    return docs / "paper" / "results.json"


def record_file(docs: Path) -> Path:
    """What each figure was drawn from."""
    return docs / "paper" / "figures.json"


def write_all(runs: Path, docs: Path) -> Written:
    """Collect the runs into the stored results, and write figures and page from these.

    Parameters
    ----------
    runs
        The folder of all runs.
    docs
        Where ``paper.md``, ``paper/results.json`` and ``images/paper-*.png`` go.
    """
    results, page = results_file(docs), docs / "paper.md"
    stored = collect(runs, read_stored(results))
    write_stored(stored, results)
    stored = read_stored(results)  # as anyone has it who reads the page again
    pictures = draw_figures(stored, runs, docs / "images", record_file(docs))
    write_text(page, render_page(stored))
    return Written(stored, (results, record_file(docs), *pictures, page))
