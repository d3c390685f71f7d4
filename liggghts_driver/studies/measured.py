"""What the runs of a study of effects say: for each how it ended, its numbers, its cost."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from liggghts_driver.errors import DriverError
from liggghts_driver.solve import load
from liggghts_driver.studies.observables import observe
from liggghts_driver.studies.tasks import core_s

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from liggghts_driver.solve import Solution
    from liggghts_driver.studies.variants import Variant
    from liggghts_driver.sweeps.task import Outcome, Task


@dataclass(frozen=True)
class Run:
    """One run of a study: how it ended, and its numbers.

    Attributes
    ----------
    failure
        Why there is no answer; None when there is.
    verdict, reasons
        Of the answer.
    observables
        By name, see ``observables``.
    wall_s
        Time of the engine, by the clock.
    time_s_per_simulated_s
        Its core time over the simulated time.
    steps, step_s
        Their number and length.
    reused
        Whether it was found finished.
    provenance
        Of the answer.
    """

    variant: str
    seed: int
    folder: Path
    failure: str | None = None
    verdict: str | None = None
    reasons: tuple[str, ...] = ()
    observables: dict[str, float] = field(default_factory=dict)
    wall_s: float | None = None
    time_s_per_simulated_s: float | None = None
    steps: int | None = None
    step_s: float | None = None
    reused: bool = False
    provenance: dict[str, object] = field(default_factory=dict)


def measure(
    tasks: Mapping[tuple[Variant, int], Task],
    outcomes: Mapping[str, Outcome],
    read: Callable[[Path], Solution] = load,
) -> list[Run]:
    """Read the runs of a study; one that failed, or that cannot be read, is kept as failed.

    Parameters
    ----------
    tasks
        Of each variant and seed.
    outcomes
        How each of them ended, by its name.
    read
        What reads a finished run directory; ``load`` writes its report, too.
    """
    return [
        _measured(variant, seed, task.folder, outcomes[task.name], read)
        for (variant, seed), task in tasks.items()
    ]


def _measured(
    variant: Variant,
    seed: int,
    folder: Path,
    outcome: Outcome,
    read: Callable[[Path], Solution],
) -> Run:
    if outcome.ending != "done":
        return Run(variant.name, seed, folder, failure=outcome.reason)
    try:
        solution = read(folder)
        observables = observe(solution)
    except DriverError as error:
        return Run(variant.name, seed, folder, failure=str(error))
    results, time = solution.results, solution.case.time
    return Run(
        variant.name,
        seed,
        folder,
        verdict=results["verdict"],
        reasons=tuple(results["reasons"]),
        observables=observables,
        wall_s=results["cost"]["wall_s"],
        time_s_per_simulated_s=core_s(results["cost"]) / (time.steps * time.step_s),
        steps=time.steps,
        step_s=time.step_s,
        reused=outcome.reused,
        provenance=results["provenance"],
    )
