"""A sweep on this machine: as many runs at once as it has cores, each on cores of its own."""

from __future__ import annotations

import os
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import TYPE_CHECKING

from liggghts_driver.engine.stop import signals_as_wishes
from liggghts_driver.errors import SweepError
from liggghts_driver.sweeps.task import Listener, Outcome, Task
from liggghts_driver.sweeps.work import work_on

if TYPE_CHECKING:
    from collections.abc import Sequence

    from liggghts_driver.engine.stop import Stop

_LOOK_EVERY_S = 0.2


def cores_here() -> list[int]:
    """The cores that this process may use."""
    return sorted(os.sched_getaffinity(0))


def run_local(
    tasks: Sequence[Task],
    stop: Stop,
    retries: int = 0,
    cores: Sequence[int] | None = None,
    listener: Listener | None = None,
) -> dict[str, Outcome]:
    """Do tasks in their order, each on as many cores as it has ranks; a failure stops none.

    Parameters
    ----------
    tasks
        What to do.
    stop
        The wish that all of it end, each run at its next checkpoint; signals express it too.
    retries
        How often a task that failed is tried again.
    cores
        Numbers of the cores to use; all of this process by default.
    listener
        Is told how it goes on.

    Returns
    -------
    Name of a task to how it ended; tasks whose turn never came are not in it.

    Raises
    ------
    SweepError
        If a task needs more cores than there are.
    """
    pool = _Pool(tasks, stop, retries, cores_here() if cores is None else cores, listener)
    with signals_as_wishes(stop):
        return pool.run()


class _Pool:
    """Threads that wait for engines: what they do themselves takes little time beside those."""

    def __init__(
        self,
        tasks: Sequence[Task],
        stop: Stop,
        retries: int,
        cores: Sequence[int],
        listener: Listener | None,
    ) -> None:
        self._waiting = list(reversed(tasks))
        self._stop, self._retries = stop, retries
        self._free = list(cores)
        self._listener = listener or Listener()
        self._at_work: dict[Future[Outcome], tuple[Task, list[int]]] = {}
        largest = max((task.ranks for task in tasks), default=0)
        if largest > len(cores):
            raise SweepError(
                f"resources.ranks = {largest}: must be at most {len(cores)}, the cores that this "
                "machine lends; lower it, or use --executor slurm"
            )

    def run(self) -> dict[str, Outcome]:
        outcomes: dict[str, Outcome] = {}
        with ThreadPoolExecutor(max(1, len(self._free)), "sweep") as threads:
            while self._at_work or (self._waiting and not self._stop.asked):
                self._start(threads)
                ended, _ = wait(self._at_work, _LOOK_EVERY_S, FIRST_COMPLETED)
                for future in ended:
                    task, outcome = self._end(future)
                    outcomes[task.name] = outcome
                self._listener.on_look()
        return outcomes

    def _start(self, threads: ThreadPoolExecutor) -> None:
        """Start what fits on the free cores; in order, so that no large task waits for ever."""
        while self._waiting and not self._stop.asked:
            if self._waiting[-1].ranks > len(self._free):
                return
            task = self._waiting.pop()
            cores = [self._free.pop() for _ in range(task.ranks)]
            self._at_work[threads.submit(self._work, task, cores)] = (task, cores)

    def _end(self, future: Future[Outcome]) -> tuple[Task, Outcome]:
        task, cores = self._at_work.pop(future)
        self._free += cores
        error = future.exception()
        if isinstance(error, KeyboardInterrupt):
            outcome = Outcome("interrupted", "ended at once, without a checkpoint")
        elif error is not None:
            outcome = Outcome("failed", f"{type(error).__name__}: {error}")
        else:
            outcome = future.result()
        self._listener.on_end(task, outcome)
        return task, outcome

    def _work(self, task: Task, cores: list[int]) -> Outcome:
        # Of this thread alone; the engine inherits it.
        os.sched_setaffinity(0, cores)
        self._listener.on_start(task)
        return work_on(
            task,
            self._retries,
            self._stop,
            lambda case: self._listener.on_case(task, case),
            lambda step: self._listener.on_step(task, step),
        )
