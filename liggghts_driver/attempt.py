"""A try at a run: the engine launched, from checkpoint to checkpoint, until the run is whole."""

from __future__ import annotations

import os
import platform
import time
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NoReturn

from liggghts_driver.case import Checkpoint
from liggghts_driver.claim import current_job
from liggghts_driver.deck.build import build_deck
from liggghts_driver.engine.completion import last_line_with, missing_proofs, missing_so_far
from liggghts_driver.engine.diagnose import engine_errors, failure_message, lost_spheres
from liggghts_driver.engine.find import Engine, find_engine
from liggghts_driver.engine.launch import launch
from liggghts_driver.errors import RunError, RunInterrupted, RunUnstableError
from liggghts_driver.identity import scene_hash
from liggghts_driver.outputs import write_text
from liggghts_driver.results.thermo import Thermo, read_logs, read_thermo
from liggghts_driver.watch import Watch, recorded_finding
from liggghts_driver.written import other_than_written, write_deck

if TYPE_CHECKING:
    from collections.abc import Callable

    from liggghts_driver.case import Case
    from liggghts_driver.deck.build import Deck
    from liggghts_driver.engine.launch import Launch
    from liggghts_driver.engine.stop import Stop
    from liggghts_driver.rundir import RunDirectory
    from liggghts_driver.watch import Finding

#: What of the time plan a run keeps, so that a later version of this software reads it right.
_PLAN = ("step_s", "steps", "sample_every", "refresh_every", "frame_every", "image_every")
#: The engine's split is believed when it tells of this share of the stepping.
_TOLD = 0.9


@dataclass
class Attempt:
    """Everything that a launch needs; the claim on the directory is the caller's."""

    case: Case
    directory: RunDirectory
    ranks: int
    on_step: Callable[[int], None]
    stop: Stop
    on_note: Callable[[str], None]
    engine: Engine = field(default_factory=find_engine)
    failures: int = field(init=False)
    begun_again: str | None = field(init=False)

    def __post_init__(self) -> None:
        known = self.directory.read_state()
        self.failures, self.begun_again = known.get("failures", 0), known.get("begun_again")

    def run(self) -> Thermo:
        """Launch until the run is whole, going on from checkpoints; what the engine logged.

        Raises
        ------
        RunError
            If the engine failed or its run is not whole; the folder stays. At once where this very
            run was stopped before: it would go the same way.
        RunInterrupted
            If it was asked to end, and did at a checkpoint.
        """
        finding = recorded_finding(self.directory)
        why = self._why_anew(finding)
        if why is None and finding is not None:
            raise RunUnstableError(finding.message_again(self.directory))
        if why is not None and self.directory.segments():
            kept = self.directory.set_aside(segments=True)
            self.begun_again = f"begun again from its start, since {why}; the rest is in {kept}"
            self.on_note(self.begun_again)
        while True:
            thermo = self._launch(self._taken_up())
            if thermo is not None:
                return thermo
            if self.stop.asked:
                raise RunInterrupted(self._whereabouts())

    def _why_anew(self, finding: Finding | None) -> str | None:
        """Why what was begun here cannot be gone on with; None where it can."""
        directory = self.directory
        begun = bool(directory.segments())
        if not begun and finding is None:
            return None  # nothing is there: no deck has to be built to see that
        if begun:
            fault = directory.checkpoint_fault() or self._missing_data()
            if fault is not None:
                return fault
        other = other_than_written(self.case, directory, self.identity)
        if other is not None:
            return f"its {other} is not what this version of the software writes"
        state, now = directory.read_state(), (self.ranks, self.engine.version)
        if finding is not None and (state.get("ranks"), state.get("engine")) != now:
            # What was found at its end may have begun before its last checkpoint.
            return "it was stopped, and had another engine or number of processes"
        return None

    def _missing_data(self) -> str | None:
        """What of the data up to the last checkpoint is lost."""
        step = self.directory.checkpoints()[-1]["step"]
        return "; ".join(missing_so_far(self.case, self.directory, step)) or None

    @property
    def identity(self) -> str:
        """What the run is known by."""
        return scene_hash(self.case.identity)

    def _taken_up(self) -> Case:
        """The case from its last checkpoint on, if there is one."""
        checkpoints = self.directory.checkpoints()
        if not checkpoints:
            return self.case
        last = checkpoints[-1]
        restart = self.directory.segments()[-1].restarts / last["restart"]
        then = Checkpoint(
            number=len(checkpoints),
            step=last["step"],
            restart=str(restart.relative_to(self.directory.path)),
            piston_velocity_m_s=last["piston_velocity_m_s"],
        )
        return replace(self.case, checkpoint=then)

    def _launch(self, case: Case) -> Thermo | None:
        """One launch of the engine; None when it ended at a checkpoint."""
        directory, command = self.directory, self.engine.command(self.ranks)
        deck = build_deck(case, self.identity, self.ranks)
        directory.set_aside(segments=False)
        write_deck(case, deck, directory)
        facts = self._facts(command)
        directory.write_state(state="running", **facts)
        watch = Watch(case, directory, self._ask, self.stop.grace_s)
        ended = self._follow(command, facts, watch)
        mark = last_line_with(directory, deck.mark)
        # What came after the last look: nothing goes on from a state that is lost.
        finding = watch.judge() if mark is not None or watch.finding else None
        if finding is not None:
            self._fail(facts, [finding.fault], finding)
            raise RunUnstableError(finding.message(directory))
        if mark is not None:
            self._seal(mark.removeprefix(deck.mark).split(), facts, ended)
            return None
        return self._prove(deck, facts, ended, watch)

    def _facts(self, command: list[str]) -> dict[str, Any]:
        """What is recorded of a launch when it starts."""
        return {
            "scene_hash": self.identity,
            "ranks": self.ranks,
            "command": command,
            "engine": self.engine.version,
            "host": platform.node(),
            "pid": os.getpid(),
            "job": current_job(),
            "time": {name: getattr(self.case.time, name) for name in _PLAN},
            "started": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
            "failures": self.failures,
            "continuations": len(self.directory.segments()),
            "begun_again": self.begun_again,
        }

    def _follow(self, command: list[str], facts: dict[str, Any], watch: Watch) -> Launch:
        directory = self.directory
        try:
            return launch(
                command,
                directory.path,
                directory.stdout,
                self.on_step,
                self.stop,
                self._ask,
                watch.look,
                alone=self.ranks == 1,
            )
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt):
                directory.write_state(state="interrupted", **facts)
            elif isinstance(error, RunUnstableError) and watch.finding is not None:
                self._fail(facts, [watch.finding.fault], watch.finding)
            else:
                self._fail(facts, [f"{type(error).__name__}: {error}"])
            raise

    def _ask(self) -> None:
        """Ask the engine for a checkpoint at the end of the piece at hand."""
        commands = self.directory.checkpoint_commands.read_text(encoding="utf-8")
        write_text(self.directory.control, commands)

    def _seal(self, numbers: list[str], facts: dict[str, Any], ended: Launch) -> None:
        """Keep a checkpoint, and all that led to it."""
        step, velocity = int(numbers[0]), float(numbers[1])
        restart = f"step.{step}.restart"
        if not (self.directory.restarts / restart).exists():
            faults = [f"the engine wrote no {restart}"]
            self._fail(facts, faults)
            raise RunError(failure_message(self.directory, faults))
        checkpoint = {
            "step": step,
            "restart": restart,
            "restart_bytes": (self.directory.restarts / restart).stat().st_size,
            "piston_velocity_m_s": velocity,
            "ranks": self.ranks,
            "wall_s": ended.wall_s,
            "cpu_s": ended.cpu_s,
        }
        self.directory.seal_segment(checkpoint)
        facts["continuations"] += 1
        self.directory.write_state(state="interrupted", **facts)

    def _prove(self, deck: Deck, facts: dict[str, Any], ended: Launch, watch: Watch) -> Thermo:
        """The whole run, if it is whole. What the watch would say of it then is the verdict's."""
        directory, case = self.directory, self.case
        # What it printed, where it died before it opened a log.
        thermo = read_logs(directory) if directory.log.exists() else read_thermo(directory.stdout)
        faults = missing_proofs(case, deck.sentinel, directory, thermo, ended.returncode)
        parts = directory.checkpoints()
        outcome = {
            **facts,
            "wall_s": ended.wall_s + sum(part["wall_s"] for part in parts),
            "cpu_s": _sum([ended.cpu_s, *(part.get("cpu_s") for part in parts)]),
            "returncode": ended.returncode,
            "parts": _engine_parts(thermo),
        }
        if faults:
            self._give_up(outcome, faults, thermo, watch)
        directory.write_state(state="complete", **outcome)
        directory.gather_frames()
        directory.drop_restarts()
        return thermo

    def _give_up(
        self, facts: dict[str, Any], faults: list[str], thermo: Thermo, watch: Watch
    ) -> NoReturn:
        """Record an engine that failed, with what its last rows and frames say."""
        steps = thermo.rows.get("Step", [0])
        last = int(max(steps, default=0))
        finding = watch.diagnose(last, lost=lost_spheres(self.directory))
        errors = [*engine_errors(self.directory), *thermo.errors][:1]
        if finding is None:
            self._fail(facts, [*errors, *faults])
            raise RunError(failure_message(self.directory, faults))
        self._fail(facts, [finding.fault, *errors, *faults], finding)
        told = [finding.fault, *faults]
        raise RunUnstableError(failure_message(self.directory, told, finding.details))

    def _fail(
        self, facts: dict[str, Any], faults: list[str], finding: Finding | None = None
    ) -> None:
        failures = facts["failures"] + 1
        known = {**facts, "state": "failed", "failures": failures, "faults": faults}
        if finding is not None:
            known["diagnosis"] = finding.as_facts()
        self.directory.write_state(**known)

    def _whereabouts(self) -> str:
        step, time_plan = self.directory.checkpoints()[-1]["step"], self.case.time
        done, whole = step * time_plan.step_s, time_plan.steps * time_plan.step_s
        return (
            f"interrupted at {done:.4g} of {whole:.4g} s; {self.directory.path} keeps a "
            "checkpoint, from which the same command goes on"
        )


def _sum(times_s: list[float | None]) -> float | None:
    """A sum of times; None if one is not known, as of a part that an older version ran."""
    known = [time_s for time_s in times_s if time_s is not None]
    return sum(known) if len(known) == len(times_s) else None


def _engine_parts(thermo: Thermo) -> dict[str, float]:
    """The engine's own split of its time, where it tells of nearly all of it; else nothing.

    A run that renews something in between is told in pieces that the engine does not split.
    """
    told, taken = sum(thermo.timing_s.values()), sum(loop.seconds for loop in thermo.loops)
    if told < _TOLD * taken:
        return {}
    return {f"engine_{name.lower()}_s": seconds for name, seconds in thermo.timing_s.items()}
