"""What the commands of sweeps print."""

from __future__ import annotations

import contextlib
import sys
import time
from typing import TYPE_CHECKING, Any

from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from liggghts_driver.cli.show import document
from liggghts_driver.cli.terminal import new_console
from liggghts_driver.report.numbers import number
from liggghts_driver.scene.canonical import canonical_json
from liggghts_driver.sweeps.cost import plan_cost
from liggghts_driver.sweeps.status import points_by_verdict
from liggghts_driver.sweeps.task import Listener
from liggghts_driver.sweeps.tasks import label

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from liggghts_driver.case import Case
    from liggghts_driver.sweeps.collect import Collected
    from liggghts_driver.sweeps.plan import Plan, Point
    from liggghts_driver.sweeps.status import RunState, State
    from liggghts_driver.sweeps.task import Outcome, Task

#: Seconds between plain lines.
_LINE_EVERY_S = 10.0
#: Failed points that are listed by name.
_LISTED = 10


def preview(plan: Plan, points: Sequence[Point], folder: Path, free_bytes: float) -> None:
    """What a sweep is about to do: its points, what they cost, and the disk they take."""
    facts, console = _facts(plan, points), new_console(soft_wrap=True)
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_row("sweep", Text(plan.title))
    table.add_row("points", f"{facts['points']}, {facts['runs']} runs, {facts['to_do']} to do")
    for key, values in facts["axes"].items():
        shown = ", ".join(map(_short, values[:8])) + (", ..." if len(values) > 8 else "")
        table.add_row(Text(f"  {key}"), Text(f"{len(values)}: {shown}"))
    low, high = (_duration(facts[f"core_time_{kind}_s"]) for kind in ("dilute", "packed"))
    table.add_row("time", f"{low} on one core if all stays dilute, {high} if all is packed")
    disk = facts["disk_bytes"]
    table.add_row("disk", f"{number(disk / 1e6)} MB of {number(free_bytes / 1e9)} GB free")
    table.add_row("folder", Text(str(folder)))
    console.print(table)
    if disk > free_bytes:
        console.print("[bold]warning[/bold]: that is more than is free")


def preview_document(plan: Plan, points: Sequence[Point], folder: Path) -> None:
    """The same as one JSON document."""
    document({**_facts(plan, points), "folder": str(folder)})


def _facts(plan: Plan, points: Sequence[Point]) -> dict[str, Any]:
    wanted = {point.run for point in points}
    cost = plan_cost(plan, wanted)
    return {
        "title": plan.title,
        "points": len(plan.points),
        "runs": len({point.run for point in plan.points}),
        "to_do": len(points),
        "axes": {key: _values(plan, key) for key in plan.axes},
        "particle_steps": cost.particle_steps,
        "core_time_dilute_s": cost.core_s_dilute,
        "core_time_packed_s": cost.core_s_packed,
        "disk_bytes": cost.disk_bytes,
    }


def _values(plan: Plan, key: str) -> list[Any]:
    """Each value of an axis once; vectors and tables are values too."""
    return list({canonical_json(p.values[key]): p.values[key] for p in plan.points}.values())


def status(
    plan: Plan,
    states: Mapping[str, RunState],
    counted: Mapping[State, int],
    folder: Path,
    *,
    as_json: bool,
) -> None:
    """How many points are in each state, how often runs failed and went on, and what failed why."""
    failed = [point for point in plan.points if states[point.run].state in ("failed", "lost")]
    counts = {
        "failures": sum(state.failures for state in states.values()),
        "continuations": sum(state.continuations for state in states.values()),
    }
    verdicts = points_by_verdict(plan, states)
    if as_json:
        troubles = [
            {"point": p.index, "run": p.run, "state": states[p.run].state, "values": p.values}
            | {"reason": states[p.run].reason}
            for p in failed
        ]
        known = {"points": counted, "verdicts": verdicts, **counts}
        document({"folder": str(folder), **known, "failed": troubles})
        return
    console = new_console(soft_wrap=True)
    table = Table("points", "", box=None, pad_edge=False, show_header=False)
    table.add_row("points", str(len(plan.points)))
    rows = {f"  {state}": n for state, n in counted.items() if n or state == "done"}
    done = {f"    {verdict.replace('_', ' ')}": n for verdict, n in verdicts.items()}
    for name, count in ({"  done": rows.pop("  done")} | done | rows | counts).items():
        table.add_row(name, str(count))
    console.print(table)
    for point in failed[:_LISTED]:
        found = states[point.run]
        words = f"{found.state}: {label(point)} ({point.run}): {found.reason}"
        console.print(words, markup=False, highlight=False)
    if len(failed) > _LISTED:
        console.print(f"... and {len(failed) - _LISTED} more; --json lists all")


def collected(found: Collected, folder: Path, *, as_json: bool) -> None:
    """Where the tables, figures and the page are."""
    verdicts = found.verdicts
    if as_json:
        files = [str(path) for path in found.files]
        known = {"points": len(found.points), "verdicts": verdicts}
        document({"page": str(found.page), "files": files, **known, "notes": list(found.notes)})
        return
    console = new_console(soft_wrap=True)
    for note in found.notes:
        console.print(f"note: {note}", markup=False)
    console.print(f"{len(found.points)} points, {len(found.pooled)} combinations")
    told = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in verdicts.items())
    console.print(f"verdicts: {told or 'none'}", markup=False)
    console.print(f"tables, figures: {folder}", markup=False)
    console.print(f"page: {found.page}", markup=False)


class _Progress(Listener):
    """How far a sweep is, by the time that each task is expected to take."""

    def __init__(self, tasks: Sequence[Task], cores: int) -> None:
        # Where nothing is known of a task, it counts as the others do on average.
        known = [task.cost_s for task in tasks if task.cost_s > 0.0]
        mean = sum(known) / len(known) if known else 1.0
        self.costs = {task.name: task.cost_s or mean for task in tasks}
        self.cores = cores
        self.shares: dict[str, float] = {}
        self.steps: dict[str, int] = {}
        self.counted = {"done": 0, "failed": 0, "interrupted": 0, "busy": 0}
        self.gone = 0.0
        self.start = time.monotonic()

    def on_start(self, task: Task) -> None:
        """It is at work."""
        self.shares[task.name] = 0.0

    def on_case(self, task: Task, case: Case) -> None:
        """Its length is known."""
        self.steps[task.name] = case.time.steps

    def on_step(self, task: Task, step: int) -> None:
        """It is so far."""
        self.shares[task.name] = step / self.steps.get(task.name, max(1, step))

    def on_end(self, task: Task, outcome: Outcome) -> None:
        """It is over."""
        self.shares.pop(task.name, None)
        self.counted[outcome.ending] += 1
        self.gone += self.costs[task.name]

    def line(self) -> str:
        """All of it in a line."""
        counts = ", ".join(f"{number} {name}" for name, number in self.counted.items() if number)
        at_work = f"{len(self.shares)} at work"
        return f"{counts or '0 done'} of {len(self.costs)}, {at_work}{self._to_go()}"

    def _to_go(self) -> str:
        running = sum(share * self.costs[name] for name, share in list(self.shares.items()))
        share = (self.gone + running) / sum(self.costs.values())
        elapsed = time.monotonic() - self.start
        if share <= 0.0 or elapsed < 1.0:
            return ""
        return f", {_duration(elapsed * (1.0 - share) / share)} to go"


class _Lines(_Progress):
    """A plain line now and then, for logs."""

    def __init__(self, tasks: Sequence[Task], cores: int) -> None:
        super().__init__(tasks, cores)
        self.last = time.monotonic()

    def on_look(self) -> None:
        """Print, if the last line is old enough."""
        if time.monotonic() - self.last >= _LINE_EVERY_S:
            self.last = time.monotonic()
            print(self.line(), file=sys.stderr, flush=True)


class _Board(_Progress):
    """A live table of what is at work."""

    def __init__(self, tasks: Sequence[Task], cores: int, live: Live) -> None:
        super().__init__(tasks, cores)
        self.live = live

    def on_look(self) -> None:
        """Draw it again."""
        table = Table(box=None, show_header=False, pad_edge=False)
        for name, share in list(self.shares.items()):
            table.add_row(Text(name), ProgressBar(1.0, share, width=24), f"{share:4.0%}")
        table.add_row(Text(self.line(), style="bold"))
        self.live.update(table)


@contextlib.contextmanager
def following(tasks: Sequence[Task], cores: int, *, quiet: bool) -> Iterator[Listener]:
    """What follows a sweep: a live table on a terminal, lines elsewhere, nothing when quiet."""
    console = new_console(stderr=True)
    if quiet or not tasks:
        yield Listener()
    elif not console.is_terminal:
        yield _Lines(tasks, cores)
    else:
        with Live(console=console, transient=True, refresh_per_second=4) as live:
            yield _Board(tasks, cores, live)


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _duration(seconds: float) -> str:
    """A time in the largest unit that leaves two digits or so."""
    for unit, size in (("d", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 1.5 * size:
            return f"{seconds / size:.1f} {unit}"
    return f"{seconds:.0f} s"
