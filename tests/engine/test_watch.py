"""Runs of the real engine that go wrong: each is stopped early, and named rightly."""

from __future__ import annotations

import re
from functools import partial

import pytest
from small_scenes import COLLISION, FLUID, GONE, INFILTRATION, MATERIAL, case_of, scene_of

from liggghts_driver import attempt, written
from liggghts_driver.errors import RunInterrupted, RunUnstableError
from liggghts_driver.run import run_case
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.solve import solve
from liggghts_driver.watch import Watch

from .test_continuation import Wished, asked_at

pytestmark = pytest.mark.engine

WALLS = ["x-", "x+", "y-", "y+", "z-", "z+"]
#: A box of fast elastic spheres: nothing but the contacts changes their energy.
GAS = {
    "particles": MATERIAL,
    "spheres": [
        {"radius": 0.003, "position": [x, y, z], "velocity": [0.5 + 25 * x, 10 * y - 0.3, 0.2]}
        for x in (-0.012, 0.0, 0.012)
        for y in (-0.012, 0.0, 0.012)
        for z in (-0.012, 0.0, 0.012)
    ],
    "contact": {"restitution": 1.0, "largest_overlap": 0.9},
    "box": {"low": [-0.02] * 3, "high": [0.02] * 3, "walls": WALLS},
    "time": {"duration": 200.0},
    "output": {"samples": 100000, "frames": 100, "images": 0},
}
#: A piston that its contacts are far too soft for: it goes through the particles.
CRUSH = {
    "contact.stiffness_scale": 1e-5, "time.step_fraction": 0.4, "piston.acceleration": 0.5,
    "time.duration": 200.0, "output.samples": 20000, "output.frames": 5000,
    "fluid": GONE, "pressure": GONE,
}  # fmt: skip


def stopped(tmp_path, tables, changes=None, ranks: int = 1):
    """Run what must go wrong; the case, its directory and what was said."""
    case, run = case_of(tables, changes), RunDirectory(tmp_path / "run")
    with pytest.raises(RunUnstableError) as caught:
        run_case(case, run, ranks)
    state = run.read_state()
    assert state["state"] == "failed"
    # Each of these runs would take minutes; the first per cent of the series is enough.
    assert state["diagnosis"]["step"] < 0.1 * case.time.steps
    assert "what to do:" in str(caught.value)
    return case, run, str(caught.value)


def rule(run) -> str:
    return run.read_state()["diagnosis"]["rule"]


@pytest.mark.parametrize("ranks", [1, 2])
def test_contacts_too_soft_for_a_piston(tmp_path, ranks):
    _, run, text = stopped(tmp_path, INFILTRATION, CRUSH, ranks)
    # The engine may lose a sphere before it is looked at.
    assert rule(run) in {"overlap", "lost"}
    assert "of the smaller radius" in text
    assert re.search(r"deepest contact: particle \d+ and (the piston|particle \d+|grain \d+)", text)
    assert "raise contact.stiffness_scale above 1e-05" in text
    # Where the engine came to its checkpoint the state can be looked at; it may end before that.
    assert rule(run) == "overlap" or not list(run.restarts.glob("step.*.restart"))


def test_a_step_as_long_as_a_contact(tmp_path):
    """A whole contact in one step: the energy that it gives back is anything."""
    _, run, text = stopped(tmp_path, GAS, {"time.step_fraction": 1.0})
    # The engine may lose a sphere before it is looked at; what came before that is told then.
    assert rule(run) in {"speed", "energy", "lost"}
    assert "were expected" in text or "J of" in text
    assert "time.step_fraction than 1" in text


def test_a_sphere_that_leaves_by_an_open_face(tmp_path):
    changes = {"time.duration": 1000.0, "output.samples": 1000, "output.frames": 500}
    changes["spheres"] = [{**COLLISION["spheres"][0], "velocity": [0.0, 0.0, 0.001]}]
    _, run, text = stopped(tmp_path, COLLISION, changes)
    assert rule(run) == "lost"
    assert "next to leave: particle 1" in text
    assert "by z+ (open)" in text
    assert "Lost atoms" in text


def edited(patch, change) -> None:
    """Change every deck behind the driver's back."""
    build = attempt.build_deck

    def other(*args, **kwargs):
        deck = build(*args, **kwargs)
        text = change(deck.files["deck.in"])
        assert text != deck.files["deck.in"]
        deck.files["deck.in"] = text
        return deck

    patch.setattr(attempt, "build_deck", other)
    patch.setattr(written, "build_deck", other)  # what a run is compared with that goes on


#: Two spheres that meet and part again in a closed box, in half a million steps.
LONG = {"time.duration": 60.0, "output.samples": 6000, "output.frames": 600, "box.walls": WALLS}


def not_a_number_from(step: int):
    """A force on particle 2 that is 0 x infinity from that step on, and 0 before."""
    force = f"0.0*exp((id==2)*1e3*(step-{step - 1}))"
    lines = f'variable nothing atom "{force}"\nfix nothing particles addforce v_nothing 0.0 0.0\n'
    mark = "# ---- 6. Integration"
    return lambda deck: deck.replace(mark, lines + mark)


def named_2(text: str) -> bool:
    """Which particle it was, and where it was while it had a place."""
    seen = re.search(r"in the frame of step \d+ \(.*\): not a number: 2\n", text)
    before = re.search(r"in the frame before, of step \d+: particle 2 at \([-.0-9e]+, 0, 0\)", text)
    return bool(seen and before)


def test_what_is_not_a_number(tmp_path):
    with pytest.MonkeyPatch.context() as patch:
        edited(patch, not_a_number_from(5000))
        case, run, text = stopped(tmp_path, COLLISION, LONG)
    assert rule(run) == "not a number"
    # In the first row that can have it: the engine computes forces before it prints.
    every = case.time.sample_every
    assert run.read_state()["diagnosis"]["step"] == -(-5000 // every) * every
    assert "not a number in kinetic_energy_j" in text
    assert named_2(text)
    assert not list(run.path.rglob("*.restart"))
    assert run.segments() == []


def test_a_checkpoint_of_what_is_not_a_number_is_not_kept_as_good(tmp_path):
    """Nobody looks until the engine has written it."""
    case, run = case_of(COLLISION, LONG), RunDirectory(tmp_path / "run")
    with pytest.MonkeyPatch.context() as patch:
        edited(patch, not_a_number_from(5000))
        patch.setattr(Watch, "look", lambda _: None)
        patch.setattr(attempt, "write_deck", partial(asked_at, 10000))
        with pytest.raises(RunUnstableError) as caught:
            run_case(case, run, stop=Wished())
    assert rule(run) == "not a number"
    assert named_2(str(caught.value))
    assert run.segments() == []
    assert run.read_state()["continuations"] == 0


def test_what_is_not_a_number_at_the_end_of_a_run_is_no_answer(tmp_path):
    """The run is whole before anybody looks: its verdict says so."""
    scene = scene_of(COLLISION, {"box.walls": WALLS})
    steps = case_of(COLLISION, {"box.walls": WALLS}).time.steps
    with pytest.MonkeyPatch.context() as patch:
        edited(patch, not_a_number_from(steps - 1))
        patch.setattr(Watch, "look", lambda _: None)
        solution = solve(scene, tmp_path / "run", report=False)
    assert solution.results["verdict"] == "invalid"
    assert solution.results["reasons"][0] == "not a number in: kinetic_energy_j"


@pytest.mark.parametrize("what", ["not a number", "overlap"])
def test_in_a_launch_from_a_checkpoint(tmp_path, what):
    """It goes on until it goes wrong; and the same run, asked for again, is not begun again."""
    tables, changes, early, where = {
        "not a number": (COLLISION, LONG, 0.005, "particle 2"),
        "overlap": (
            INFILTRATION,
            {**CRUSH, "piston.acceleration": 0.05},
            0.0005,
            "deepest contact",
        ),
    }[what]
    case, run = case_of(tables, changes), RunDirectory(tmp_path / "run")
    checkpoint = round(early * case.time.steps)
    with pytest.MonkeyPatch.context() as patch:
        if what == "not a number":
            edited(patch, not_a_number_from(4 * checkpoint))
        with pytest.MonkeyPatch.context() as first:
            first.setattr(attempt, "write_deck", partial(asked_at, checkpoint))
            with pytest.raises(RunInterrupted):
                run_case(case, run, stop=Wished())
        with pytest.raises(RunUnstableError) as caught:
            run_case(case, run)
        state = run.read_state()
        # A sphere may be lost before anybody looks.
        assert state["diagnosis"]["rule"] in {what, "lost"}
        assert checkpoint < state["diagnosis"]["step"] < 0.1 * case.time.steps
        assert (state["failures"], state["continuations"]) == (1, 1)
        assert where in str(caught.value)
        with pytest.raises(RunUnstableError, match="not run again") as again:
            run_case(case, run)
        assert state["diagnosis"]["seen"] in str(again.value)
        assert run.read_state() == state


def test_a_piston_goes_into_the_grains(tmp_path):
    """Grains are fixed and in no frame; a heavy piston against one is in the series alone."""
    changes = {**CRUSH, "piston.mass": 10.0, "particles.count": 1, "grains.youngs_modulus": 1e4}
    _, run, text = stopped(tmp_path, INFILTRATION, {**changes, "contact.stiffness_scale": 1.0})
    # It may pass through all of them, and out of the box, before anybody looks.
    assert rule(run) in {"overlap", "lost"}
    assert re.search(r"the piston overlaps grain \d+ by [.0-9]+ of its radius", text)


def test_a_stream_beyond_the_branches_of_the_drag_law(tmp_path):
    """Re is a hundred times what the scene says, in the deck alone: the stream as fast as ever."""
    changes = {"fluid": {**FLUID, "velocity_outside": "constant", "velocity": 0.01},
               "spheres": COLLISION["spheres"][:1], "drag.scheme": "exact",
               "box.walls": WALLS, "time.duration": 50.0, "output.samples": 5000}  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        edited(patch, lambda deck: deck.replace("(4000000.0*r)^2", "(400000000.0*r)^2"))
        _, run, text = stopped(tmp_path, COLLISION, changes)
    assert rule(run) == "reynolds"
    assert "largest Re: particle 1 at" in text
