"""Time commands side by side: in turn, several times, medians and spread."""

from __future__ import annotations

import statistics
import subprocess
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver.engine.find import launch_environment

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path


@dataclass(frozen=True)
class Sample:
    """Repeated measurements of one thing [s]."""

    seconds: tuple[float, ...]

    @property
    def median(self) -> float:
        return statistics.median(self.seconds)

    def over(self, other: Sample) -> Sample:
        """Ratios, repetition by repetition, so that a drifting machine cancels."""
        pairs = zip(self.seconds, other.seconds, strict=True)
        return Sample(tuple(a / b for a, b in pairs))

    def __str__(self) -> str:
        return f"{self.median:.3g} ({min(self.seconds):.3g} to {max(self.seconds):.3g})"


def interleave(tasks: Mapping[str, Callable[[], float]], repeats: int) -> dict[str, Sample]:
    """Measure every task in turn, `repeats` times after one turn that does not count."""
    taken: dict[str, list[float]] = {name: [] for name in tasks}
    for turn in range(repeats + 1):
        for name, task in tasks.items():
            seconds = task()
            print(f"  turn {turn}: {name}: {seconds:.3f} s", flush=True)
            if turn:
                taken[name].append(seconds)
    return {name: Sample(tuple(values)) for name, values in taken.items()}


def wall_seconds(command: Sequence[str], folder: Path) -> float:
    """Wall time of a command as a whole process; its failure is an error."""
    start = time.perf_counter()
    done = subprocess.run(
        command,
        cwd=folder,
        env=launch_environment(),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    seconds = time.perf_counter() - start
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)} in {folder} failed:\n{done.stdout[-2000:]}")
    return seconds
