"""What the watch has seen: the rule that was broken, where, and what to do about it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Literal

from liggghts_driver.results.plain import plain

if TYPE_CHECKING:
    from liggghts_driver.rundir import RunDirectory

Rule = Literal["not a number", "energy", "speed", "overlap", "reynolds", "lost"]
#: After these there is nothing worth a checkpoint.
HOPELESS: frozenset[Rule] = frozenset({"not a number", "lost"})


@dataclass(frozen=True)
class Finding:
    """A run that cannot end well.

    Attributes
    ----------
    rule
        The rule that was broken.
    seen
        What was seen, with its limit, in words.
    value, limit
        The same as numbers, in the unit that ``seen`` has.
    step, time_s
        When it was seen first.
    where
        Which particles and which contacts, in the frame nearest to it.
    advice
        What to do about it.
    """

    rule: Rule
    seen: str
    value: float
    limit: float
    step: int
    time_s: float
    where: tuple[str, ...] = ()
    advice: str = ""

    @property
    def fault(self) -> str:
        """The finding in one line."""
        return f"{self.seen}, at {self.time_s:.4g} s (step {self.step})"

    @property
    def details(self) -> list[str]:
        """Where it was, and what to do."""
        return [*(f"where: {place}" for place in self.where), f"what to do: {self.advice}"]

    def as_facts(self) -> dict[str, Any]:
        """Plain data for ``run.json``."""
        facts: dict[str, Any] = plain(asdict(self))
        return facts

    def message(self, run: RunDirectory) -> str:
        """The message of a run that was stopped for it; the folder stays as it is."""
        kept = sorted(path.name for path in run.restarts.glob("*.restart"))
        state = f"; its state then is in {run.restarts.name}/{kept[-1]}" if kept else ""
        parts = [
            f"the run was stopped: {self.fault}",
            *(f"  {line}" for line in self.details),
            f"  everything is kept in {run.path}{state}",
        ]
        return "\n".join(parts)

    def message_again(self, run: RunDirectory) -> str:
        """The message where such a run is asked for once more, and nothing is done."""
        parts = [
            f"not run again: {run.path} holds this very run, which was stopped: {self.fault}",
            *(f"  {line}" for line in self.details),
            "  it would go the same way; to see that, remove the folder or choose another (--out)",
        ]
        return "\n".join(parts)


def recorded_finding(run: RunDirectory) -> Finding | None:
    """The finding for which the run in a directory failed; None if it did for none."""
    known = run.read_state()
    facts = known.get("diagnosis") if known["state"] == "failed" else None
    return None if facts is None else Finding(**{**facts, "where": tuple(facts["where"])})
