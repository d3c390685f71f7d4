"""What the commands print: tables for people, one JSON document for programs."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from rich.table import Table
from rich.text import Text

from liggghts_driver.cli.terminal import new_console

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from rich.console import Console

    from liggghts_driver.engine.doctor import Finding

#: Keys of the estimate that a table shows per gradient, with a heading.
_PER_GRADIENT = {
    "pressure_gradient_pa_m": "gradient\nPa/m",
    "darcy_flux_m_s": "flux q\nm/s",
    "flow_rate_m3_s": "flow rate Q\nm3/s",
    "particle_flow_rate_m3_s": "of particles\nm3/s",
    "pore_velocity_m_s": "pore velocity\nm/s",
    "reynolds": "Re",
    "valid": "valid",
}

#: A table with a column for each of them needs so many characters.
_WIDE = 76


def document(data: object) -> None:
    """One JSON document on stdout."""
    print(json.dumps(data, indent=2))


def results(answer: Mapping[str, Any], path: Path, *, reused: bool, as_json: bool) -> None:
    """The answer of a run."""
    if as_json:
        document({**answer, "run_directory": str(path), "reused": reused})
        return
    console = new_console(soft_wrap=True)
    if reused:
        told = f"{path} holds this run, finished; nothing was computed again"
        console.print(told, markup=False)
    console.print(f"verdict: [bold]{answer['verdict']}[/bold]")
    for reason in answer["reasons"]:
        console.print(f"  {reason}", markup=False)
    if answer["sections"]:
        _flow(console, answer)
    for check in answer["exact"]:
        console.print(
            f"{check['name']}: {check['simulated']:.6g}, exactly {check['exact']:.6g}",
            markup=False,
        )
    for note in answer["notes"]:
        console.print(f"note: {note}", markup=False)
    _accuracy(console, answer)
    cost = answer["cost"]
    console.print(
        f"{cost['particles']} particles, {cost['steps']} steps in {cost['wall_s']:.1f} s on "
        f"{cost['ranks']} rank(s)"
    )
    console.print(f"report: {path / 'report.html'}", markup=False)


def _accuracy(console: Console, answer: Mapping[str, Any]) -> None:
    accuracy = answer["accuracy"]
    for sentence in accuracy.get("sentences", ()):
        console.print(sentence, markup=False, highlight=False)
    settings = ", ".join(
        f"{name} = {value}" for name, value in accuracy.get("settings", {}).items()
    )
    if settings:
        console.print(f"settings: {settings}", markup=False, highlight=False)


def _table(*heads: str) -> Table:
    """A table in which a number that is too long goes on in the next line, instead of being cut."""
    table = Table()
    for head in heads:
        table.add_column(head, overflow="fold")
    return table


def _flow(console: Console, answer: Mapping[str, Any]) -> None:
    table = _table("", "simulated", "95 % interval", "estimate", "ratio")
    for name, section in answer["sections"].items():
        rate = section["particle_flow_rate_m3_s"]
        table.add_row(
            Text(f"Q particles, {name} [m3/s]"), *_row(rate, answer["comparison"].get(name, {}))
        )
    velocity = answer["flowing_velocity_m_s"]
    table.add_row(
        Text("flowing velocity [m/s]"),
        *_row(velocity, answer["comparison"].get("flowing_velocity", {})),
    )
    console.print(table)
    for warning in answer["comparison"].get("estimate_warnings", []):
        console.print(f"the estimate: {warning}", markup=False)


def _row(measured: Mapping[str, Any], compared: Mapping[str, Any]) -> tuple[str, ...]:
    return (
        _number(measured["mean"]),
        f"± {_number(measured['ci95'])}",
        _number(compared.get("estimated")),
        _number(compared.get("ratio")),
    )


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def estimate(answer: Mapping[str, Any], *, as_json: bool) -> None:
    """The Darcy estimate."""
    if as_json:
        document(answer)
        return
    console = new_console(soft_wrap=True)
    columns = {name: _list(answer[name]) for name in _PER_GRADIENT}
    for name, value in answer.items():
        if isinstance(value, float) and name not in _PER_GRADIENT:
            console.print(f"{name:32} {value:.4g}", markup=False)
    rows = [[_cell(value) for value in row] for row in zip(*columns.values(), strict=True)]
    _per_gradient(console, rows)
    for warning in answer["warnings"]:
        console.print(f"warning: {warning}", markup=False)


def _per_gradient(console: Console, rows: Sequence[Sequence[str]]) -> None:
    """A row for each gradient; where the window is too narrow for that, a line for each number."""
    if console.width >= _WIDE:
        table = _table(*_PER_GRADIENT.values())
        for row in rows:
            table.add_row(*row)
        console.print(table)
        return
    for row in rows:
        for head, cell in zip(_PER_GRADIENT.values(), row, strict=True):
            console.print(f"{head.replace(chr(10), ' '):20} {cell}", markup=False)


def _list(value: Any) -> Sequence[Any]:
    return value if isinstance(value, list) else [value]


def _cell(value: Any) -> str:
    return ("yes" if value else "no") if isinstance(value, bool) else f"{value:.4g}"


def explanation(facts: Mapping[str, Any], *, as_json: bool) -> None:
    """Effects, bounds on the step, and the size of a run."""
    if as_json:
        document(facts)
        return
    console = new_console(soft_wrap=True)
    _accuracy(console, facts)
    console.print(_effects(facts["effects"]))
    for effect in facts["effects"]:
        if effect.get("weak"):
            console.print(_weak(effect), markup=False, highlight=False)
    if facts["drag"] is not None:
        console.print(_drag(facts["drag"]), markup=False, highlight=False)
    bounds = Table("bound on the step", "s", "why")
    for bound in facts["time_step_bounds"]:
        bounds.add_row(bound["name"], f"{bound['step_s']:.3g}", bound["reason"])
    console.print(bounds)
    for name, value in facts["size"].items():
        text = f"{value:.4g}" if isinstance(value, float) else str(value)
        console.print(f"{name:28} {text}", markup=False)
    least, most = (_duration(facts["predicted_wall_s"][state]) for state in ("dilute", "packed"))
    text = f"predicted wall time on one core: {least} (dilute throughout) to {most} (packed)"
    console.print(text, markup=False, highlight=False)


def _effects(effects: Sequence[Mapping[str, Any]]) -> Table:
    table = Table("effect", "", "why", "number", "time")
    for effect in effects:
        state = "in" if effect["active"] else "out"
        number, time = "", ""
        if effect["active"]:
            value = "infinite" if effect["value"] is None else f"{effect['value']:.3g}"
            number = f"{effect['number']} {value}"
            time = f"{100.0 * effect['time_share']:.0f} %"
        table.add_row(effect["title"], state, Text(effect["why"]), number, time)
    return table


def _weak(effect: Mapping[str, Any]) -> str:
    change, saved = 100.0 * effect["motion_share"], 100.0 * effect["time_share"]
    return (
        f"{effect['title']} is weak: without it the motion would change by about {change:.2g} %, "
        f"and {saved:.0f} % of the time be saved (see effects.screen)"
    )


def _duration(seconds: float) -> str:
    if seconds < 1:
        return "under 1 s"
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def _drag(facts: Mapping[str, Any]) -> str:
    text = f"drag: Re up to {facts['largest_reynolds']:.3g}; {facts['scheme']} scheme"
    every, interval = facts["refresh_every_steps"], facts["refresh_interval_s"]
    if facts["scheme"] == "exact":
        return f"{text}, computed at every step"
    pace = f"every {every} steps ({interval:.3g} s)"
    if facts["velocity_tolerance"] is None:
        return f"{text}, computed {pace}, as drag.refresh asks"
    error = 100.0 * facts["velocity_tolerance"]
    return f"{text}, computed {pace}, to {error:.2g} % of a velocity"


def doctor(findings: Sequence[Finding], *, as_json: bool) -> None:
    """What was found, and what is missing."""
    if as_json:
        document([vars(finding) for finding in findings])
        return
    console = new_console(soft_wrap=True)
    for finding in findings:
        mark = "ok     " if finding.found else "missing"
        console.print(f"{mark} {finding.name}: {finding.detail}", markup=False, highlight=False)
