"""How a sweep stands: the state of each of its runs, read from their directories alone."""

from __future__ import annotations

import json
import os
import re
from collections import Counter
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, Literal, get_args

from liggghts_driver.claim import alive, describe, job_runs

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from pathlib import Path

    from liggghts_driver.sweeps.plan import Plan

#: ``queued``: in the queue of a cluster; ``lost``: its worker is gone without a word.
State = Literal["done", "running", "queued", "waiting", "interrupted", "lost", "failed"]
STATES: tuple[State, ...] = get_args(State)
#: More than any state file is long.
_BYTES = 65536
#: As `RunDirectory.write_state` writes them.
_COMPLETE = b'"state": "complete"'
#: As results begin, and how far one has to look for it.
_VERDICT, _START_BYTES = re.compile(rb'"verdict": "(\w+)"'), 64
_COUNTS = tuple(re.compile(rb'"%s": (\d+)' % name) for name in (b"failures", b"continuations"))


@dataclass(frozen=True, slots=True)
class RunState:
    """How a run stands, why, and how often it has failed and gone on.

    ``hopeless`` is one that was diagnosed: the same again would end the same way. ``verdict`` is
    that of a run that is done.
    """

    state: State
    reason: str = ""
    failures: int = 0
    continuations: int = 0
    hopeless: bool = False
    verdict: str = ""


def run_states(
    names: Iterable[str],
    runs: Path,
    queued: Mapping[str, str] | None = None,
    asks: Callable[[str], bool] = job_runs,
) -> dict[str, RunState]:
    """State of each run, by its name.

    Parameters
    ----------
    names
        Names of run directories.
    runs
        The folder that holds them.
    queued
        Name of a run to the state of its job, for those in the queue of a cluster.
    asks
        Whether a job of the cluster still runs; asked once for each.
    """
    asked = cache(asks)
    root, waits = str(runs), queued or {}
    return {name: _state(f"{root}/{name}", waits.get(name), asked) for name in names}


def points_by_verdict(plan: Plan, states: Mapping[str, RunState]) -> dict[str, int]:
    """How many of the points that are done have which verdict, the most frequent first."""
    done = (states[point.run] for point in plan.points)
    return dict(Counter(found.verdict for found in done if found.state == "done").most_common())


def points_by_state(plan: Plan, states: Mapping[str, RunState]) -> dict[State, int]:
    """How many points are in each state; points of one scene share its run."""
    counted = Counter(states[point.run].state for point in plan.points)
    return {state: counted[state] for state in STATES}


def _state(folder: str, queued: str | None, asked: Callable[[str], bool]) -> RunState:
    # Twenty thousand of these are read in a second: no Path, and no parser where a look will do.
    raw = _raw(f"{folder}/run.json")
    counts = _counted(raw)
    if _COMPLETE in raw:
        answer = _raw(f"{folder}/results.json", _START_BYTES)
        if not answer:
            # Whole, but its worker died before it had read the results: the next one will.
            return RunState("waiting", "", *counts)
        found = _VERDICT.search(answer)
        return RunState("done", "", *counts, verdict=found[1].decode() if found else "unreadable")
    claim = _parse(_raw(f"{folder}/claim.json"))
    if claim and alive(claim, asked):
        return RunState("running", describe(claim), *counts)
    if queued is not None:
        return RunState("queued", queued, *counts)
    known = _parse(raw)
    state, reason = _ended(known, claim)
    return RunState(state, reason, *counts, bool(known.get("diagnosis")))


def _counted(raw: bytes) -> tuple[int, int]:
    """Failures and continuations."""
    failures, continuations = (
        int(match[1]) if (match := word.search(raw)) else 0 for word in _COUNTS
    )
    return failures, continuations


def _ended(known: dict[str, Any], claim: dict[str, Any]) -> tuple[State, str]:
    """The state of a run that nobody works on, and why."""
    kind = known.get("state")
    if kind == "failed":
        return "failed", _first(known.get("faults"))
    if kind == "interrupted":
        return "interrupted", "it will go on from its last checkpoint"
    if kind == "running" or claim:
        who = describe(claim or known)
        return "lost", f"its worker is gone ({who}); it will be done again"
    return "waiting", ""


def _raw(path: str, most: int = _BYTES) -> bytes:
    """What a small file holds, or the start of any; nothing if it is not there."""
    try:
        descriptor = os.open(path, os.O_RDONLY)
    except OSError:
        return b""
    try:
        return os.read(descriptor, most)
    except OSError:  # a folder, say
        return b""
    finally:
        os.close(descriptor)


def _parse(raw: bytes) -> dict[str, Any]:
    """A table of JSON; an empty one if it is none."""
    try:
        loaded = json.loads(raw.decode()) if raw else {}
    except ValueError:
        return {}
    return loaded if isinstance(loaded, dict) else {}


def _first(faults: object) -> str:
    return str(faults[0]) if isinstance(faults, list) and faults else "no reason is known"
