"""The watch over a launch: looks now and then at what is new, and stops a run that is lost."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING

from liggghts_driver.errors import RunUnstableError
from liggghts_driver.results.contacts import largest_over_radius
from liggghts_driver.watch.advice import advice
from liggghts_driver.watch.finding import HOPELESS, Finding, Rule
from liggghts_driver.watch.rules import (
    Breach,
    Limits,
    breach_of_contacts,
    breach_of_places,
    breach_of_row,
    missing_ids,
)
from liggghts_driver.watch.suspects import last_seen, suspects, whole_contacts
from liggghts_driver.watch.tail import FrameTail, SeriesTail

if TYPE_CHECKING:
    from collections.abc import Callable

    from liggghts_driver.case import Case
    from liggghts_driver.rundir import RunDirectory
    from liggghts_driver.watch.tail import Snapshot

#: Time between two looks.
_EVERY_S = 0.2
#: Looking takes at most this share of the time, so that it costs a run next to nothing.
_SHARE = 0.05


class Watch:
    """Judges the rows and frames of one launch as the engine writes them.

    Attributes
    ----------
    finding
        What was found first; None while nothing is wrong.
    """

    def __init__(
        self,
        case: Case,
        run: RunDirectory,
        ask: Callable[[], None] = lambda: None,
        grace_s: float = math.inf,
    ) -> None:
        self._case, self._run, self._ask = case, run, ask
        self._grace_s = grace_s
        self._limits = Limits.of(case)
        self._series = SeriesTail(run.engine_series)
        self._frames = FrameTail(case, run)
        self._piston_x_m: dict[int, float] = {0: case.layout.low[0]}
        self._last_row: dict[str, float] = {}
        self._next_look = self._ends_at = -math.inf
        self.finding: Finding | None = None

    def look(self) -> None:
        """Look at what is new, if it is time to; to be called again and again.

        The engine is asked for a checkpoint when something is found.

        Raises
        ------
        RunUnstableError
            If a checkpoint would be of no use, or does not come in time.
        """
        start = time.monotonic()
        if start < self._next_look:
            return
        if self.finding is None:
            self.judge()
            self._act(start)
        elif start > self._ends_at:
            raise RunUnstableError(self.finding.message(self._run))
        end = time.monotonic()
        self._next_look = end + max(_EVERY_S, (end - start) / _SHARE)

    def _act(self, now: float) -> None:
        if self.finding is None:
            return
        if self.finding.rule in HOPELESS:
            raise RunUnstableError(self.finding.message(self._run))
        self._ends_at = now + self._grace_s
        self._ask()

    def judge(self) -> Finding | None:
        """Judge all that came since the last time; what was found first, now or before."""
        if self.finding is None:
            self._judge_rows()
        if self.finding is None:
            self._judge_frame()
        return self.finding

    def _judge_rows(self) -> None:
        for row in self._series.new_rows():
            if "piston_x_m" in row:
                self._piston_x_m[int(row["step"])] = row["piston_x_m"]
            self._last_row = row
            breach = breach_of_row(row, self._case, self._limits)
            if breach is not None:
                self._frames.newest()
                self.finding = self._found(breach, int(row["step"]))
                return

    def _judge_frame(self) -> None:
        snapshot = self._frames.newest()
        if snapshot is None:
            return
        breach = breach_of_places(snapshot, self._case)
        if breach is None:
            contacts = whole_contacts(snapshot, self._case, self._piston(snapshot))
            breach = breach_of_contacts(snapshot, contacts, self._case, self._limits)
        if breach is not None:
            self.finding = self._found(breach, snapshot.step)

    def diagnose(self, step: int, *, lost: bool) -> Finding | None:
        """What the last rows and frames say of an engine that failed; None if nothing.

        Where it failed for spheres that it had lost, after ``step``, there is always something.
        """
        before = self.judge()
        if not lost:
            return before
        fastest = self._last_row.get("largest_speed_m_s", math.nan)
        if fastest < 0.0:
            fastest = math.nan  # of no particle the engine's largest is its smallest number
        seen = (
            "spheres left the engine's box before the next row of its log; the largest speed was "
            f"{fastest:.3g} m/s in the last row of the series, "
            f"{self._case.speed_bound_m_s:.3g} were expected"
        )
        finding = self._found(Breach("lost", seen, math.nan, 0.0), step)
        if before is None:
            return finding
        return replace(finding, where=(f"before that, {before.fault}", *finding.where))

    def _found(self, breach: Breach, step: int) -> Finding:
        snapshot, case = self._frames.last, self._case
        where = suspects(breach.rule, snapshot, case, self._piston(snapshot))
        return Finding(
            rule=breach.rule,
            seen=breach.seen,
            value=breach.value,
            limit=breach.limit,
            step=step,
            time_s=step * case.time.step_s,
            where=(*where, *self._last_seen(snapshot)),
            advice=self._advice(breach.rule, snapshot),
        )

    def _last_seen(self, snapshot: Snapshot | None) -> tuple[str, ...]:
        """Where those that are missing in a frame were in the one before it."""
        missing = missing_ids(snapshot, self._case) if snapshot else []
        earlier = self._frames.before(snapshot.step) if snapshot and missing else None
        return last_seen(missing, earlier, self._case) if earlier else ()

    def _advice(self, rule: Rule, snapshot: Snapshot | None) -> str:
        deepest = 0.0
        if snapshot is not None and snapshot.finite.any():
            contacts = whole_contacts(snapshot, self._case, self._piston(snapshot))
            deepest = largest_over_radius(contacts)
        return advice(rule, self._case, deepest)

    def _piston(self, snapshot: Snapshot | None) -> float | None:
        if self._case.scene.piston is None or snapshot is None:
            return None
        return self._piston_x_m.get(snapshot.step)
