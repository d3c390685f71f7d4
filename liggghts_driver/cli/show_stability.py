"""What the study of stability prints: a row for each case, then what broke; or JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

from liggghts_driver.cli.show import document
from liggghts_driver.report.numbers import NONE, number

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

_HEADS = ("case", "hardest invariant", "worst", "limit", "margin", "then")
_NUMBERS = frozenset({"worst", "limit", "margin"})


def stability(results: Mapping[str, Any], folder: Path, *, as_json: bool) -> None:
    """The table, the cases that are not as expected, and where the files are."""
    if as_json:
        document({**results, "folder": str(folder)})
        return
    console = Console(highlight=False)
    table = Table(box=None, padding=(0, 1, 0, 0))
    for head in _HEADS:
        table.add_column(head, justify="right" if head in _NUMBERS else "left")
    for row in results["cases"]:
        table.add_row(*_cells(row))
    console.print(table)
    for row in results["cases"]:
        if not row["as_expected"]:
            why = row["why"] or f"{row['expected']} was expected"
            console.print(f"broken: {row['case']}: {why}", markup=False, soft_wrap=True)
    if not results["broken"]:
        console.print(f"all {len(results['cases'])} cases are as expected")
    files = "stability.json, stability.csv" + (", stability.png" if results["map"] else "")
    console.print(f"{files} in {folder}", markup=False, soft_wrap=True)


def _cells(row: Mapping[str, Any]) -> list[str]:
    if row["expected"] != "holds":
        return [row["case"], f"{row['expected']}: {row['why']}", "", "", "", ""]
    return [
        row["case"],
        row["hardest_invariant"] or row["why"],
        number(row["worst"], 2),
        number(row["limit"], 2),
        _margin(row),
        row["breaks_by"],
    ]


def _margin(row: Mapping[str, Any]) -> str:
    if row["margin"] is None:
        return NONE
    # Nothing broke, or only the driver's own refusal stands beyond.
    at_least = row["breaks_at"] is None or row["refused_beyond"]
    return ("≥ " if at_least else "") + number(row["margin"], 2)
