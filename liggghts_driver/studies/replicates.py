"""Run the variants of a scene with several seeds, one run after another."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

from liggghts_driver.errors import DriverError, EngineNotFoundError, RunFolderError
from liggghts_driver.studies.observables import observe

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from liggghts_driver.scene.model import Scene
    from liggghts_driver.solve import Solution
    from liggghts_driver.studies.variants import Variant


class Solve(Protocol):
    """What runs a scene in a folder: ``liggghts_driver.solve.solve``."""

    def __call__(self, scene: Scene, out: Path, /) -> Solution:
        """Run, or find finished."""


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
    wall_s, time_s_per_simulated_s
        Time of the engine, also over the simulated time.
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


class Listener:
    """Is told of each run as it starts and ends; says nothing by itself."""

    def on_start(self, number: int, total: int, variant: Variant, seed: int) -> None:
        """A run starts."""

    def on_end(self, run: Run) -> None:
        """It has ended."""


def in_turn(variants: Sequence[Variant], seeds: Sequence[int]) -> list[tuple[Variant, int]]:
    """All variants in turn for one seed, then for the next: a machine that drifts favours none."""
    return [(variant, seed) for seed in seeds for variant in variants]


def run_in_turn(
    scene: Scene,
    variants: Sequence[Variant],
    seeds: Sequence[int],
    out: Path,
    run: Solve,
    listener: Listener,
) -> list[Run]:
    """Run every variant with every seed in ``out/<variant>/seed-<n>``; finished runs are reused.

    A run that fails is kept as failed, and the others go on.

    Raises
    ------
    RunFolderError
        If a folder holds something else.
    EngineNotFoundError
        If no run can be.
    """
    plan = in_turn(variants, seeds)
    runs = []
    for number, (variant, seed) in enumerate(plan, 1):
        listener.on_start(number, len(plan), variant, seed)
        runs.append(_one(scene, variant, seed, out / variant.name / f"seed-{seed}", run))
        listener.on_end(runs[-1])
    return runs


def _one(scene: Scene, variant: Variant, seed: int, folder: Path, run: Solve) -> Run:
    try:
        solution = run(variant.scene(scene, seed), folder)
        observables = observe(solution)
    except (RunFolderError, EngineNotFoundError):
        raise
    except DriverError as error:
        return Run(variant.name, seed, folder, failure=str(error))
    results, time = solution.results, solution.case.time
    wall_s = results["cost"]["wall_s"]
    return Run(
        variant.name,
        seed,
        folder,
        verdict=results["verdict"],
        reasons=tuple(results["reasons"]),
        observables=observables,
        wall_s=wall_s,
        time_s_per_simulated_s=wall_s / (time.steps * time.step_s),
        steps=time.steps,
        step_s=time.step_s,
        reused=solution.reused,
        provenance=results["provenance"],
    )
