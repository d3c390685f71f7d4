"""A task of a sweep, how it ends, and who is told."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from liggghts_driver.case import Case
    from liggghts_driver.scene.model import Scene

Ending = Literal["done", "failed", "interrupted", "busy"]


@dataclass(frozen=True)
class Task:
    """One run to be done.

    Attributes
    ----------
    name
        What people call it.
    scene
        Makes its scene, when it is its turn.
    folder
        Its run directory.
    ranks
        MPI processes.
    cost_s
        Time on one core that it is expected to take; 0 where nothing is known.
    alter
        As for ``solve``.
    """

    name: str
    scene: Callable[[], Scene]
    folder: Path
    ranks: int = 1
    cost_s: float = 0.0
    alter: Callable[[Case], Case] | None = None


@dataclass(frozen=True)
class Outcome:
    """How work on a task ended; ``reused`` when it was found done."""

    ending: Ending
    reason: str = ""
    reused: bool = False


class Listener:
    """Is told how a sweep goes on; says nothing by itself. Calls come from several threads."""

    def on_start(self, task: Task) -> None:
        """Work on a task starts."""

    def on_case(self, task: Task, case: Case) -> None:
        """Its spheres are placed."""

    def on_step(self, task: Task, step: int) -> None:
        """The engine reports a step."""

    def on_end(self, task: Task, outcome: Outcome) -> None:
        """Work on it has ended."""

    def on_look(self) -> None:
        """Some time has passed; from the main thread alone."""
