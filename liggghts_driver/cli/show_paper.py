"""What the study of the paper prints: Table 1 side by side, the verdicts, and the files."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from rich.table import Table

from liggghts_driver.cli.show import document
from liggghts_driver.cli.terminal import new_console
from liggghts_driver.paper.page import context_of
from liggghts_driver.paper.stored import to_text

if TYPE_CHECKING:
    from liggghts_driver.paper.write import Written

#: Letters that the table needs.
_TABLE_WIDTH = 120


def paper(written: Written, *, as_json: bool) -> None:
    """The table of flow rates, the answers in short, and where the page is."""
    if as_json:
        files = [str(path) for path in written.files]
        document({"results": json.loads(to_text(written.stored)), "files": files})
        return
    found, console = (
        context_of(written.stored),
        new_console(soft_wrap=True, highlight=False),
    )
    console.width = max(console.width, _TABLE_WIDTH)
    heads, _, *rows = [_cells(line) for line in found["tables"]["flow"].splitlines()]
    table = Table(
        *heads,
        box=None,
        pad_edge=False,
        title="particle flow rates [10⁻⁶ m³/s]",
        title_justify="left",
    )
    for row in rows:
        table.add_row(*row)
    console.print(table)
    console.print("mean ± between packings ± in time (packings)")
    for claim in found["claims"]:
        console.print(f"{claim.words}: {claim.verdict}. {claim.found}", markup=False)
    for sentence in (found["readings"][0], found["cost"]):
        console.print(sentence, markup=False)
    for failure in found["failures"]:
        console.print(failure, markup=False)
    console.print(f"{found['done']} of {found['points']} points have an answer")
    console.print(f"page: {written.files[-1]}", markup=False)


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip("| ").split("|")]
