"""The live bar: step, simulated time, time to go; plain lines where there is no terminal."""

from __future__ import annotations

import contextlib
import sys
import time
from typing import TYPE_CHECKING

from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from liggghts_driver.cli.terminal import new_console

if TYPE_CHECKING:
    from collections.abc import Iterator

    from liggghts_driver.case import Case

#: Seconds between plain lines.
_LINE_EVERY_S = 10.0


class Follower:
    """Is told of the case and of each step; shows nothing by itself."""

    def __init__(self) -> None:
        self.steps = 1
        self.step_s = 0.0

    def on_case(self, case: Case) -> None:
        """Take note of the length of the run."""
        self.steps, self.step_s = case.time.steps, case.time.step_s

    def on_step(self, step: int) -> None:
        """Take note of a step that the engine reports."""

    def on_note(self, note: str) -> None:
        """Take note of what a user should know now."""


class Bar(Follower):
    """A live bar on a terminal."""

    def __init__(self, bar: Progress) -> None:
        super().__init__()
        self._bar = bar
        self._task = bar.add_task("placing spheres", total=None, simulated="")

    def on_case(self, case: Case) -> None:
        """Start the bar."""
        super().on_case(case)
        self._bar.update(self._task, description="running", total=case.time.steps)

    def on_note(self, note: str) -> None:
        """Print it above the bar."""
        self._bar.console.print(f"note: {note}", markup=False, highlight=False, soft_wrap=True)

    def on_step(self, step: int) -> None:
        """Move the bar."""
        simulated = f"{step * self.step_s:.4g} of {self.steps * self.step_s:.4g} s"
        self._bar.update(self._task, completed=step, simulated=simulated)


class Lines(Follower):
    """A plain line now and then, for logs."""

    def __init__(self) -> None:
        super().__init__()
        self._start = self._last = time.monotonic()

    def on_case(self, case: Case) -> None:
        """Say how long the run is."""
        super().on_case(case)
        population = case.population
        print(
            f"running {population.particles} particles, {population.grains} grains, "
            f"{case.time.steps} steps of {case.time.step_s:.3g} s",
            file=sys.stderr,
            flush=True,
        )
        self._start = self._last = time.monotonic()

    def on_note(self, note: str) -> None:
        """Say it."""
        print(f"note: {note}", file=sys.stderr, flush=True)

    def on_step(self, step: int) -> None:
        """Say where the run is, if the last line is old enough."""
        now = time.monotonic()
        if now - self._last < _LINE_EVERY_S or step == 0:
            return
        self._last = now
        left = (now - self._start) * (self.steps - step) / step
        simulated = step * self.step_s
        print(
            f"step {step} of {self.steps}, {simulated:.4g} s simulated, {left:.0f} s to go",
            file=sys.stderr,
            flush=True,
        )


@contextlib.contextmanager
def follow(*, quiet: bool) -> Iterator[Follower]:
    """What follows a run: a bar on a terminal, lines elsewhere, nothing when quiet."""
    console = new_console(stderr=True)
    if quiet:
        yield Follower()
    elif not console.is_terminal:
        yield Lines()
    else:
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            TaskProgressColumn(),
            TextColumn("{task.fields[simulated]}"),
            TimeRemainingColumn(),
        )
        with Progress(*columns, console=console, transient=True) as bar:
            yield Bar(bar)
