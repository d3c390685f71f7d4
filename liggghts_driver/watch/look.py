"""The watch over a launch: looks now and then at what is new, and stops a run that is lost."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING

from liggghts_driver.contacts import largest_over_radius
from liggghts_driver.errors import RunUnstableError
from liggghts_driver.watch.advice import advice
from liggghts_driver.watch.finding import HOPELESS, Finding, Rule
from liggghts_driver.watch.rules import (
    Breach,
    Limits,
    breach_of_contacts,
    breach_of_places,
    breach_of_row,
    broken_ids,
    missing_ids,
)
from liggghts_driver.watch.suspects import last_seen, suspects, whole_contacts
from liggghts_driver.watch.tail import FrameTail, SeriesTail, read_rows

if TYPE_CHECKING:
    from collections.abc import Callable

    from liggghts_driver.case import Case
    from liggghts_driver.rundir import RunDirectory
    from liggghts_driver.watch.tail import Row, Snapshot

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
        self._last_row: Row = {}
        # A launch begins with the instant at which the one before it ended.
        for row in (row for part in run.segments()[-1:] for row in read_rows(part)):
            self._take(row)
        self._next_look = self._ends_at = -math.inf
        self.finding: Finding | None = None

    def look(self) -> None:
        """Look at what is new, if it is time to; to be called again and again.

        When something is found the engine is asked for a checkpoint; where that would be of no
        use, nothing is waited for but the frame that tells who it was.

        Raises
        ------
        RunUnstableError
            If there is nothing more to wait for, or it does not come in time.
        """
        start = time.monotonic()
        if start < self._next_look:
            return
        is_new = self.finding is None
        found = self.judge()
        if found is not None:
            self._act(found, start, is_new=is_new)
        end = time.monotonic()
        self._next_look = end + max(_EVERY_S, (end - start) / _SHARE)

    def _act(self, found: Finding, now: float, *, is_new: bool) -> None:
        hopeless = found.rule in HOPELESS
        if is_new:
            self._ends_at = now + self._grace_s
            if not hopeless:
                self._ask()
        # A row does not tell who it was: the next frame does.
        frame = self._frames.last
        known = frame is not None and frame.step >= found.step
        if now > self._ends_at or (hopeless and known):
            raise RunUnstableError(found.message(self._run))

    def judge(self) -> Finding | None:
        """Judge all that came since the last time; what was found first, now or before.

        Where a row did not tell who it was, the next frame adds it.
        """
        if self.finding is None:
            self._judge_rows()
        if self.finding is None:
            self._judge_frame()
        elif self.finding.rule in HOPELESS and self._frames.newest() is not None:
            where = self._where(self.finding.rule, self.finding.step)
            self.finding = replace(self.finding, where=where)
        return self.finding

    def _judge_rows(self) -> None:
        rows = self._series.new_rows()
        for row in rows:
            self._take(row)
        for row in rows:
            breach = breach_of_row(row, self._case, self._limits)
            if breach is not None:
                self._frames.newest()
                self.finding = self._found(breach, int(row["step"]))
                return

    def _take(self, row: Row) -> None:
        if "piston_x_m" in row:
            self._piston_x_m[int(row["step"])] = row["piston_x_m"]
        self._last_row = row

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
        who = "spheres" if self._case.scene.piston is None else "spheres or the piston"
        seen = (
            f"{who} left the engine's box before the next row of its log; the largest speed was "
            f"{fastest:.3g} m/s in the last row of the series, "
            f"{self._case.speed_bound_m_s:.3g} were expected"
        )
        finding = self._found(Breach("lost", seen, math.nan, 0.0), step)
        if before is None:
            return finding
        return replace(finding, where=(f"before that, {before.fault}", *finding.where))

    def _found(self, breach: Breach, step: int) -> Finding:
        return Finding(
            rule=breach.rule,
            seen=breach.seen,
            value=breach.value,
            limit=breach.limit,
            step=step,
            time_s=step * self._case.time.step_s,
            where=self._where(breach.rule, step),
            advice=self._advice(breach.rule, self._frames.last),
        )

    def _where(self, rule: Rule, step: int) -> tuple[str, ...]:
        """Who it was, by the newest frame; and where those were before that are no more."""
        frame, case = self._frames.last, self._case
        where = suspects(rule, frame, case, self._piston(frame))
        ids = (missing_ids(frame, case) or broken_ids(frame)) if frame else []
        earlier = self._frames.before(min(step, frame.step)) if frame and ids else None
        return (*where, *(last_seen(ids, earlier, case) if earlier else ()))

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
