"""What the study of stability prints: a row for each case, then what broke; or JSON."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

from rich.table import Table

from liggghts_driver.cli.show import document
from liggghts_driver.cli.terminal import new_console
from liggghts_driver.report.numbers import NONE, number
from liggghts_driver.studies.sabotage import (
    HALF,
    LONGER_STEP,
    NO_DRAG,
    NO_PISTON,
    NO_PRESSURE,
    WEAK_SERVO,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from rich.console import Console

_HEADS = ("case", "hardest", "worst", "limit", "margin", "then")
_NUMBERS = frozenset({"worst", "limit", "margin"})
#: Names of invariants, short enough for a table of 80 columns.
_SHORT = {
    "change with half the step": "step halved",
    "change by a restart": "restart",
    "energy without work": "energy",
    "free piston off a t²/2": "free piston",
    "numbers that are none": "not a number",
    "piston's speed [m/s]": "piston's speed",
}
_SAME = "same"
_ON_PURPOSE = f"broken on purpose, and caught by ({_SAME}: it makes no difference)"
#: Columns of what was broken on purpose, and the sabotages that each is about.
_SABOTAGES: Mapping[str, Callable[[str], bool]] = {
    "step": lambda name: name == LONGER_STEP,
    "walls": lambda name: name.startswith("no wall"),
    "piston": lambda name: name in (NO_PISTON, WEAK_SERVO),
    "forces": lambda name: name in (NO_DRAG, NO_PRESSURE),
    "drag's 0.5": lambda name: name == HALF,
}


def stability(results: Mapping[str, Any], folder: Path, *, as_json: bool) -> None:
    """The tables, what is not as expected, and where the files are."""
    if as_json:
        document({**results, "folder": str(folder)})
        return
    console = new_console(highlight=False, markup=False)
    _cases(results, console)
    if results["on_purpose"]:
        _on_purpose(results, console)
    files = ["stability.json", "stability.csv"]
    files += ["broken.csv"] if results["on_purpose"] else []
    files += ["stability.png"] if results["map"] else []
    console.print(f"{', '.join(files)} in {folder}", soft_wrap=True)


def _cases(results: Mapping[str, Any], console: Console) -> None:
    table = Table(box=None, padding=(0, 1, 0, 0))
    for head in _HEADS:
        table.add_column(
            head, justify="right" if head in _NUMBERS else "left", no_wrap=head == "case"
        )
    for row in results["cases"]:
        table.add_row(*_cells(row))
    console.print(table)
    for row in results["cases"]:
        if row["expected"] != "holds":
            console.print(f"{row['expected']}: {row['case']}: {row['why']}", soft_wrap=True)
    for row in results["cases"]:
        if not row["as_expected"]:
            why = row["why"] or f"{row['expected']} was expected"
            console.print(f"broken: {row['case']}: {why}", soft_wrap=True)
    if not results["broken"]:
        console.print(f"all {len(results['cases'])} cases are as expected")


def _on_purpose(results: Mapping[str, Any], console: Console) -> None:
    """Who caught what was broken on purpose: a row for each case, then what hides."""
    table = Table(box=None, padding=(0, 1, 0, 0), title=_ON_PURPOSE)
    table.add_column("case", no_wrap=True)
    for head in _SABOTAGES:
        table.add_column(head)
    rows = results["on_purpose"]
    for case in dict.fromkeys(row["case"] for row in rows):
        own = [row for row in rows if row["case"] == case]
        kinds = ([r for r in own if is_one(r["sabotage"])] for is_one in _SABOTAGES.values())
        table.add_row(case, *map(_catchers, kinds))
    console.print(table)
    for row in rows:
        if row["fate"] not in ("caught", "no difference"):
            words = f"{row['fate']}: {row['case']}, {row['sabotage']}: {row['sentence']}"
            console.print(words, soft_wrap=True)
    if not results["hidden"]:
        caught = sum(row["fate"] == "caught" for row in rows)
        console.print(f"{caught} of {len(rows)} sabotages are caught, the others break nothing")


def _catchers(rows: Sequence[Mapping[str, Any]]) -> str:
    """Who caught these, and how many where they are several."""
    fates = (row["by"] or row["fate"] for row in rows)
    counts: Counter[str] = Counter(_SAME if fate == "no difference" else fate for fate in fates)
    if len(rows) == 1:
        return next(iter(counts))
    return ", ".join(f"{count} {who}" for who, count in counts.most_common()) or NONE


def _cells(row: Mapping[str, Any]) -> list[str]:
    if row["expected"] != "holds":
        return [row["case"], row["expected"], "", "", "", ""]
    return [
        row["case"],
        _short(row["hardest_invariant"]) or row["why"],
        number(row["worst"], 2),
        number(row["limit"], 2),
        _margin(row),
        _short(row["broken_by"]),
    ]


def _short(name: str) -> str:
    return _SHORT.get(name, name)


def _margin(row: Mapping[str, Any]) -> str:
    if row["margin"] is None:
        return NONE
    # Nothing broke, or only the driver's own refusal stands beyond.
    at_least = row["breaks_at"] is None or row["refused_beyond"]
    return ("≥ " if at_least else "") + number(row["margin"], 2)
