"""What the studies print: tables, or one JSON document."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.table import Table
from rich.text import Text

from liggghts_driver.cli.show import document
from liggghts_driver.cli.terminal import new_console
from liggghts_driver.report.numbers import NONE, number, quantity, with_error

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from rich.console import Console

#: Numbers of steps that differ by more than this are told: they are not the effect's own cost.
_OTHER_STEPS = 0.01


def effects(results: Mapping[str, Any], folder: Path, *, as_json: bool) -> None:
    """The study of effects."""
    if as_json:
        document({**results, "folder": str(folder)})
        return
    console = new_console(highlight=False)
    base, *others = results["variants"]
    if others:
        console.print(_costs(base, others))
        console.print(_changes(base, others))
    else:
        console.print(_base(base))
    for line in _remarks(results):
        console.print(line, markup=False, soft_wrap=True)
    files = "effects.png, effects.csv, effects.json" if others else "effects.csv, effects.json"
    console.print(f"{files} in {folder}", markup=False, soft_wrap=True)


def _costs(base: Mapping[str, Any], others: list[dict[str, Any]]) -> Table:
    """What each effect costs, and what was estimated of it."""
    table = Table(title="What the engine's time becomes", box=None, padding=(0, 1, 1, 0))
    table.add_column("left out")
    table.add_column("s per\nsimulated s", no_wrap=True)
    table.add_column("over\nall effects", no_wrap=True)
    table.add_column("estimated", no_wrap=True)
    table.add_column("its number, and est.\nshare of the motion")
    table.add_row("nothing", number(base["time_s_per_simulated_s"]), "1", "1", "")
    for variant in others:
        table.add_row(
            _name(variant),
            number(variant["time_s_per_simulated_s"]),
            _ratio(variant["time_ratio"]),
            f"{1.0 - variant['estimate']['time_share']:.2f}",
            _share(variant["estimate"]),
        )
    return table


def _name(variant: Mapping[str, Any]) -> Text:
    also = variant["follows"]
    title = variant["title"].removeprefix("without ")
    return Text(title + (f", and with it {', '.join(also)}" if also else ""))


def _ratio(ratio: Mapping[str, Any] | None) -> str:
    if ratio is None:
        return "not known"
    if ratio["replicates"] == 1:
        return number(ratio["median"])
    return f"{number(ratio['median'])}\n({number(ratio['smallest'])} to {number(ratio['largest'])})"


def _share(estimate: Mapping[str, Any]) -> Text:
    share = (
        ""
        if estimate["motion_share"] is None
        else f"{number(100.0 * estimate['motion_share'], 2)} %"
    )
    value = "infinite" if estimate["value"] is None else number(estimate["value"])
    return Text(f"{estimate['number']} {value}\n{share}")


def _changes(base: Mapping[str, Any], others: list[dict[str, Any]]) -> Table:
    """What leaving each effect out changes."""
    table = Table(title="What the answer becomes", box=None, padding=(0, 1, 0, 0))
    for head in ("", "all effects", "without", "change, 95 % interval"):
        table.add_column(head, no_wrap=True)
    means = {item["name"]: item["mean"] for item in base["observables"]}
    for variant in others:
        table.add_row(Text(variant["title"], style="bold"), "", "", "")
        for item in variant["observables"]:
            with_it = _quantity(means.get(item["name"]), item["unit"])
            without = _quantity(item["mean"], item["unit"])
            table.add_row(f"  {item['title']}", with_it, without, _change(item["change"]))
    return table


def _quantity(value: float | None, unit: str) -> str:
    """A mean in a unit that fits it; what is measured in radii in per cent of one."""
    if unit == "radii":
        return NONE if value is None else f"{number(100.0 * value)} % of r"
    return quantity(value, unit.replace("m3", "m³"))


def _base(base: Mapping[str, Any]) -> Table:
    """The whole scene, where there is nothing to compare it with."""
    table = Table("all effects", "mean", box=None)
    table.add_row("time per simulated s", f"{number(base['time_s_per_simulated_s'])} s")
    for item in base["observables"]:
        table.add_row(item["title"], _quantity(item["mean"], item["unit"]))
    return table


def _change(change: Mapping[str, Any] | None) -> str:
    if change is None:
        return "not known"
    if change["ci95"] is None:
        return f"{with_error(100.0 * change['mean'], None)} %, no interval"
    return f"{with_error(100.0 * change['mean'], 100.0 * change['ci95'])} %"


def _remarks(results: Mapping[str, Any]) -> Iterator[str]:
    """What a reader must know beside the tables."""
    if len(results["variants"]) == 1:
        yield "no effect of this scene can be left out: without any of them it is another problem"
    for note in results["notes"]:
        yield f"note: {note}"
    for variant in results["variants"]:
        steps = variant["steps_ratio"]
        if steps is not None and abs(steps["median"] - 1.0) > _OTHER_STEPS:
            ratio = number(steps["median"])
            yield f"note: {variant['title']} the run has {ratio} times as many steps"
        runs = [run for run in results["runs"] if run["variant"] == variant["name"]]
        yield from _faults(variant["title"], runs)


def _faults(title: str, runs: list[dict[str, Any]]) -> Iterator[str]:
    """What speaks against a variant's runs: how many, and why the first of them."""
    failed = [run for run in runs if run["failure"] is not None]
    if failed:
        seed, why = failed[0]["seed"], failed[0]["failure"].splitlines()[0]
        yield f"failed: {title}, {len(failed)} of {len(runs)} runs; seed {seed}: {why}"
    invalid = [run for run in runs if run["verdict"] == "invalid"]
    if invalid:
        seed, why = invalid[0]["seed"], "; ".join(invalid[0]["reasons"])
        yield f"invalid: {title}, {len(invalid)} of {len(runs)} runs; seed {seed}: {why}"


def accuracy(results: Mapping[str, Any], folder: Path, *, as_json: bool) -> None:
    """The study of accuracy: each setting's cost and errors, and what to choose."""
    if as_json:
        document(results)
        return
    console = new_console(soft_wrap=True)
    table = Table(box=None, pad_edge=False)
    for name in results["shown"]:
        table.add_column(name.replace("_", " ").removesuffix(" 1"), no_wrap=True)
    for setting in results["settings"]:
        table.add_row(*(_error(setting, name) for name in results["shown"]))
    # Titles are too long for a column: each stands above its numbers.
    heads, *rows = _lines(table, console)
    console.print(heads, markup=False, highlight=False)
    for setting, row in zip(results["settings"], rows, strict=True):
        overlap = number(100.0 * setting["largest_overlap_over_radius"], 2)
        time = number(setting["cost_over_reference"])
        cost = f"{time} of the time, overlaps up to {overlap} % of a radius"
        console.print(Text.assemble((setting["title"], "bold"), f": {cost}"), highlight=False)
        console.print(row, markup=False, highlight=False)
    console.print("in brackets: not told from no error (95 %)", markup=False)
    for order in results["orders"]:
        console.print(f"order of the {_order(order)}", markup=False, highlight=False)
    for name, reason in results["failures"].items():
        console.print(f"no answer: {name}: {reason.splitlines()[0]}", markup=False)
    for sentence in results["sentences"]:
        console.print(sentence, markup=False)
    console.print(f"accuracy.png, accuracy.csv, accuracy.json in {folder}", markup=False)


def _order(order: Mapping[str, Any]) -> str:
    """What was expected of a knob, and what came out."""
    found = (
        "not told from no error"
        if order["measured"] is None
        else f"{number(order['measured'], 2)} by {order['values']} values"
    )
    what = f"{order['of'].replace('_', ' ')} in the {order['knob']}"
    return f"{what}: expected {number(order['expected'], 2)}, measured {found}"


def _error(setting: Mapping[str, Any], name: str) -> str:
    """An error with its interval, in brackets where it may be none."""
    text = _change(setting["errors"].get(name))
    exact = setting["knob"] == "reference"
    return f"({text})" if name in setting["below_noise"] and not exact else text


def _lines(table: Table, console: Console) -> list[str]:
    """A table as its lines, none of them folded."""
    with console.capture() as captured:
        console.print(table)
    return captured.get().rstrip("\n").split("\n")
