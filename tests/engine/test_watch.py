"""Runs of the real engine that go wrong: each is stopped early, and named rightly."""

from __future__ import annotations

import re

import pytest
from small_scenes import COLLISION, FLUID, GONE, INFILTRATION, MATERIAL, case_of

from liggghts_driver import attempt
from liggghts_driver.errors import RunUnstableError
from liggghts_driver.run import run_case
from liggghts_driver.rundir import RunDirectory

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


def test_a_stream_beyond_the_branches_of_the_drag_law(tmp_path):
    """Re is a hundred times what the scene says, in the deck alone: the stream as fast as ever."""
    changes = {"fluid": {**FLUID, "velocity_outside": "constant", "velocity": 0.01},
               "spheres": COLLISION["spheres"][:1], "drag.scheme": "exact",
               "box.walls": WALLS, "time.duration": 50.0, "output.samples": 5000}  # fmt: skip
    build = attempt.build_deck

    def faster(*args, **kwargs):
        deck = build(*args, **kwargs)
        deck.files["deck.in"] = deck.files["deck.in"].replace(
            "(4000000.0*r)^2", "(400000000.0*r)^2"
        )
        return deck

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(attempt, "build_deck", faster)
        _, run, text = stopped(tmp_path, COLLISION, changes)
    assert rule(run) == "reynolds"
    assert "largest Re: particle 1 at" in text
