"""The hard cases on the engine: each holds, and what is broken on purpose is caught and named."""

from __future__ import annotations

import re
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TYPE_CHECKING

import pytest

from liggghts_driver import attempt
from liggghts_driver.engine.stop import Stop
from liggghts_driver.errors import RunError
from liggghts_driver.scene import read_scene
from liggghts_driver.solve import solve
from liggghts_driver.studies.energy import read_ran
from liggghts_driver.studies.hard_cases import CASES, HardCase
from liggghts_driver.studies.invariants import changed_by, invariants_of
from liggghts_driver.studies.stability import Trial, judged, study_stability
from liggghts_driver.sweeps.local import cores_here, run_local
from liggghts_driver.written import write_deck

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from liggghts_driver.case import Case
    from liggghts_driver.deck.build import Deck
    from liggghts_driver.rundir import RunDirectory

    Edit = Callable[[str], str]

pytestmark = pytest.mark.engine

#: Runs side by side share the engine's wait for MPI at its start.
_SIDE_BY_SIDE = 8
QUICK = [case for case in CASES if case.quick and case.expected == "holds"]
#: Of all kinds: a minute for all quick ones is too long for every change.
FEW = {"restitution_half", "overlapping_start", "on_section", "same_place", "no_particle"}
LONG = [case for case in CASES if not case.quick]
WALLED = [case for case in QUICK if case.name in {"soft_contacts", "on_wall_and_edge"}]
#: The case in which a particle relaxes quickest, for a hundredth of its time.
VISCOUS, SHORT = HardCase("micrometre_viscous"), ["time.duration=0.002"]


def twenty_steps(deck: str) -> str:
    """A step 20 times too large, behind the back of all that the driver checks."""
    return re.sub(
        r"^(timestep +)(\S+)", lambda m: f"{m[1]}{20.0 * float(m[2])!r}", deck, flags=re.M
    )


def without_walls(deck: str) -> str:
    return re.sub(r"^fix +wall_.*\n", "", deck, flags=re.M)


def half_implicit(deck: str) -> str:
    """The engine's implicit drag with the argument that is right by its name, and is not."""
    return deck.replace("CrankNicolson 1.0", "CrankNicolson 0.5")


@pytest.fixture
def edited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Trial]:
    """Runs a case, its deck edited by a function, and tells what became of it."""
    edits: dict[Path, Edit] = {}

    def write(case: Case, deck: Deck, run: RunDirectory) -> None:
        write_deck(case, deck, run)
        text = run.deck.read_text(encoding="utf-8")
        changed = edits[run.path](text)
        assert changed != text or edits[run.path] is _untouched
        run.deck.write_text(changed, encoding="utf-8")

    monkeypatch.setattr(attempt, "write_deck", write)

    def run(case: HardCase, edit: Edit, overrides: tuple[str, ...] = ()) -> Trial:
        scene = read_scene(case.path, overrides)
        own, other = tmp_path / case.name, tmp_path / f"{case.name}-edited"
        edits.update({own: _untouched, other: edit})
        solve(scene, own, report=False)
        try:
            solve(scene, other, report=False)
        except RunError as error:
            return Trial(1.0, why=str(error))
        ran = read_ran(other)
        return judged(1.0, [*invariants_of(ran), changed_by(ran, read_ran(own))], ran.results)

    return run


def _untouched(deck: str) -> str:
    return deck


def all_edited(run: Callable[..., Trial], cases: list[HardCase], edit: Edit) -> dict[str, Trial]:
    with ThreadPoolExecutor(_SIDE_BY_SIDE) as pool:
        trials = pool.map(lambda case: run(case, edit), cases)
        return {case.name: trial for case, trial in zip(cases, trials, strict=True)}


def broken_ones(cases: list[HardCase], runs: Path) -> dict[str, str]:
    """Cases that are not as expected at their own settings, and why."""
    cores = [cores_here()[n % len(cores_here())] for n in range(_SIDE_BY_SIDE)]
    run = partial(run_local, stop=Stop(), cores=cores)
    studied = study_stability(cases, runs, run, margins=False)
    return {each.case.name: each.own.why for each in studied if not each.as_expected}


def test_some_cases_hold(tmp_path: Path) -> None:
    assert broken_ones([case for case in CASES if case.name in FEW], tmp_path) == {}


@pytest.mark.validate
def test_quick_cases_hold(tmp_path: Path) -> None:
    assert broken_ones([case for case in CASES if case.quick], tmp_path) == {}


@pytest.mark.validate
def test_long_cases_hold(tmp_path: Path) -> None:
    assert broken_ones(LONG, tmp_path) == {}


def test_steps_too_large_are_caught(edited: Callable[..., Trial]) -> None:
    trials = all_edited(edited, QUICK, twenty_steps)
    assert [name for name, trial in trials.items() if trial.holds] == []


@pytest.mark.validate
def test_steps_too_large_are_caught_in_long_cases(edited: Callable[..., Trial]) -> None:
    trials = all_edited(edited, LONG, twenty_steps)
    assert [name for name, trial in trials.items() if trial.holds] == []


def test_walls_left_out_are_caught(edited: Callable[..., Trial]) -> None:
    for name, trial in all_edited(edited, WALLED, without_walls).items():
        assert re.search("overlap|lost", trial.why), (name, trial.why)


def test_the_other_implicit_argument_is_caught(edited: Callable[..., Trial]) -> None:
    assert not edited(VISCOUS, half_implicit, SHORT).holds
