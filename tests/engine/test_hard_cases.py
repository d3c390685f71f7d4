"""The hard cases on the engine: each holds, and what is broken on purpose is caught and named."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import pytest

from liggghts_driver.engine.stop import Stop
from liggghts_driver.scene import read_scene
from liggghts_driver.studies.broken import plans_of, study_broken, try_out
from liggghts_driver.studies.hard_cases import CASES, HardCase
from liggghts_driver.studies.sabotage import (
    HALF,
    LONGER_STEP,
    NO_DRAG,
    NO_PRESSURE,
    WEAK_SERVO,
)
from liggghts_driver.studies.stability import study_stability
from liggghts_driver.sweeps.local import cores_here, run_local

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from liggghts_driver.studies.broken import Broken
    from liggghts_driver.studies.stability import Studied
    from liggghts_driver.sweeps.task import Outcome, Task

pytestmark = pytest.mark.engine

#: Runs side by side share the engine's wait for MPI at its start.
_SIDE_BY_SIDE = 8
QUICK = [case for case in CASES if case.quick and case.expected == "holds"]
LONG = [case for case in CASES if not case.quick]
#: Quick cases in which nothing touches: there a larger step breaks nothing.
UNTOUCHED = {"reynolds_all", "on_section", "no_particle"}
#: The case in which a particle relaxes quickest, for a hundredth of its time.
VISCOUS, SHORT = HardCase("micrometre_viscous"), ["time.duration=0.002"]


def run(tasks: Sequence[Task]) -> Mapping[str, Outcome]:
    cores = [cores_here()[n % len(cores_here())] for n in range(_SIDE_BY_SIDE)]
    return run_local(tasks, Stop(), cores=cores)


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of all tests: the sound runs are the same."""
    return tmp_path_factory.mktemp("runs")


def broken(
    cases: list[HardCase],
    runs: Path,
    wanted: Callable[[str], bool],
    overrides: Sequence[str] = (),
) -> list[Broken]:
    """What became of cases that were broken in the ways of these names."""
    plans = [
        plan
        for case in cases
        for plan in plans_of(case.name, read_scene(case.path, overrides), runs, wanted)
    ]
    assert plans
    return try_out(plans, run)


def hidden(found: list[Broken]) -> list[Broken]:
    return [each for each in found if each.hides]


def tried(cases: list[HardCase], runs: Path) -> list[Studied]:
    return study_stability(cases, runs, run, margins=False)


def wrong_ones(studied: list[Studied]) -> dict[str, str]:
    """Cases that are not as expected at their own settings, and why."""
    return {each.case.name: each.own.why for each in studied if not each.as_expected}


def test_every_quick_one_is_as_expected(runs: Path) -> None:
    """By itself, and held against half its step."""
    assert wrong_ones(tried([case for case in CASES if case.quick], runs)) == {}


@pytest.mark.validate
@pytest.mark.parametrize("cases", [QUICK, LONG], ids=["quick", "long"])
def test_all_hold_and_nothing_hides(cases: list[HardCase], runs: Path) -> None:
    studied = tried(cases, runs)
    assert wrong_ones(studied) == {}
    found = study_broken(studied, runs, run)
    assert hidden(found) == []
    # What nothing can break would show nothing.
    caught = {each.case for each in found if each.fate == "caught"}
    assert caught == {case.name for case in cases if case.expected == "holds"}


@pytest.mark.validate
def test_what_is_taken_up_is_taken_up_in_a_contact(runs: Path) -> None:
    (studied,) = tried([case for case in CASES if case.restarts], runs)
    outside = {each.name: each.worst for each in studied.own.invariants}
    assert outside["checkpoints outside a contact"] == 0.0


def test_steps_too_large_are_caught(runs: Path) -> None:
    found = broken(QUICK, runs, partial(str.__eq__, LONGER_STEP))
    assert hidden(found) == []
    # Beside these the piston alone: half a step ahead, it has energy that nobody gave.
    assert {each.case for each in found if each.fate != "caught"} == UNTOUCHED - {"no_particle"}


def test_walls_left_out_are_caught(runs: Path) -> None:
    cases = [case for case in QUICK if case.name in {"soft_contacts", "on_wall_and_edge"}]
    found = broken(cases, runs, lambda name: name.startswith("no wall"))
    assert hidden(found) == []
    # In the first spheres fly about; in the other one goes into each wall that is touched.
    caught = {(each.case, each.sabotage) for each in found if each.fate == "caught"}
    faces = [f"no wall {axis}{side}" for axis in "xyz" for side in "-+"]
    assert caught == {(case.name, face) for case in cases for face in faces}


def test_a_force_left_out_and_a_servo_too_weak_are_caught(runs: Path) -> None:
    """In the very cases in which no other way breaks anything."""
    cases = [case for case in QUICK if case.name in UNTOUCHED]
    found = broken(cases, runs, {NO_DRAG, NO_PRESSURE, WEAK_SERVO}.__contains__)
    assert hidden(found) == []
    caught = {(each.case, each.sabotage): each.by for each in found if each.fate == "caught"}
    assert caught == {
        ("reynolds_all", NO_DRAG): "comparison",
        ("on_section", NO_DRAG): "invariant",
        ("on_section", NO_PRESSURE): "comparison",
        ("no_particle", WEAK_SERVO): "invariant",
    }


def test_a_force_left_out_of_a_bed_is_caught(runs: Path) -> None:
    """Although in a bed nothing stays the same for long: it is told by half the step."""
    (found,) = broken([HardCase("fluid_reverses")], runs, partial(str.__eq__, NO_DRAG))
    assert (found.fate, found.by) == ("caught", "comparison")
    assert "departure from the sound run" in found.sentence


def test_the_other_implicit_argument_is_caught(runs: Path) -> None:
    (found,) = broken([VISCOUS], runs, partial(str.__eq__, HALF), SHORT)
    assert found.fate == "caught"
