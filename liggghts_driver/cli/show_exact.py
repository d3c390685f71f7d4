"""What the study of exact problems prints: a table of orders, and what is wrong; or JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.table import Table
from rich.text import Text

from liggghts_driver.cli.show import document
from liggghts_driver.cli.terminal import new_console
from liggghts_driver.report.numbers import NONE, fixed, number

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path


def exact(results: Mapping[str, Any], folder: Path, *, as_json: bool) -> None:
    """Orders, expected and measured, and the errors at both ends; then what is wrong."""
    if as_json:
        document({**results, "folder": str(folder)})
        return
    console = new_console(highlight=False)
    console.print(_table(results))
    for bug in results["bugs"]:
        console.print(bug, markup=False, soft_wrap=True)
    if not results["bugs"]:
        console.print(f"all {len(results['orders'])} orders are as expected")
    console.print(f"exact.png, exact.csv, exact.json in {folder}", markup=False, soft_wrap=True)


def _table(results: Mapping[str, Any]) -> Table:
    table = Table(box=None, padding=(0, 1, 0, 0))
    for head in ("error of", "in", "expected", "measured", "finest", "coarsest"):
        table.add_column(
            head, no_wrap=True, justify="left" if head in {"error of", "in"} else "right"
        )
    for problem in dict.fromkeys(row["problem_title"] for row in results["orders"]):
        table.add_row(Text(problem, style="bold"))
        for row in results["orders"]:
            if row["problem_title"] == problem:
                table.add_row(*_cells(row))
    return table


def _cells(row: Mapping[str, Any]) -> list[str]:
    name = ", ".join(part for part in (row["variant"], row["quantity"]) if part)
    errors = row["errors"] or [None]
    return [
        f"  {name}",
        row["knob"].split(" ")[0],
        _order(row["expected_order"]),
        _order(row["measured_order"]) + ("" if row["right"] else " off"),
        number(errors[0], 2),
        number(errors[-1], 2),
    ]


def _order(order: float | None) -> str:
    """With two decimals; a zero has no sign."""
    return NONE if order is None else fixed(round(order, 2) + 0.0, 2)
