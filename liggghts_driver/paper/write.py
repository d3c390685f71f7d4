"""Everything that the page consists of: stored results, figures, and the page itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver.outputs import require_free_names, write_text
from liggghts_driver.paper.collect import collect
from liggghts_driver.paper.figures import DRAWINGS, draw_figures
from liggghts_driver.paper.page import WRITTEN_BY, render_page
from liggghts_driver.paper.stored import read_stored, write_stored

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


def require_own_docs(docs: Path) -> None:
    """Refuse a folder of documentation in which a page or figures would be overwritten.

    Raises
    ------
    RunFolderError
        If there is a page that this study did not write, or there are such figures without one.
    """
    page, names = docs / "paper.md", [f"images/{drawing.name}.png" for drawing in DRAWINGS]
    try:
        ours = WRITTEN_BY in page.read_text(encoding="utf-8", errors="replace")
    except OSError:
        ours = False
    require_free_names(docs, ["paper.md", *names], ours=ours, option="--docs")


def write_all(runs: Path, docs: Path) -> Written:
    """Collect the runs into the stored results, and write figures and page from these.

    Parameters
    ----------
    runs
        The folder of all runs.
    docs
        Where ``paper.md``, ``paper/results.json`` and ``images/paper-*.png`` go.

    Raises
    ------
    RunFolderError
        If that would overwrite what this study did not write.
    ParseError
        If what is stored there is not what this study stores.
    """
    require_own_docs(docs)
    results, page = results_file(docs), docs / "paper.md"
    stored = collect(runs, read_stored(results))
    write_stored(stored, results)
    stored = read_stored(results)  # as anyone has it who reads the page again
    pictures = draw_figures(stored, runs, docs / "images", record_file(docs))
    write_text(page, render_page(stored))
    return Written(stored, (results, record_file(docs), *pictures, page))
