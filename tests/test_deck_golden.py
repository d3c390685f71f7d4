"""Decks as they were last looked at: ``UPDATE_GOLDEN=1 pytest tests/test_deck_golden.py`` rewrites.

The particle data are left out, and so are the version and the scene's hash; numbers may differ in
their last digits, as they do between processors and releases of NumPy.
"""

from __future__ import annotations

import difflib
import os
import re
from dataclasses import replace
from pathlib import Path

import pytest
from decks import deck_of
from small_scenes import COLLISION, FLUID, GONE, GRAIN, INFILTRATION, case_of, shipped

from liggghts_driver import __version__
from liggghts_driver.case import Checkpoint

GOLDEN = Path(__file__).parent / "golden"

GRAINS = {"youngs_modulus": 1.0e6, "poissons_ratio": 0.25}
GRAVITY = {"acceleration": [0.0, 0.0, -9.81]}

DECKS = {
    # The shipped cases.
    "two_spheres": (shipped("two_spheres"), {}, 1),
    "settling_sphere": (shipped("settling_sphere"), {}, 1),
    "infiltration_small": (shipped("infiltration_small"), {}, 1),
    "infiltration_friction": (shipped("infiltration_friction"), {}, 1),
    # What those leave out.
    "friction_rolling_walls": (
        COLLISION,
        {"contact.friction": 0.3, "contact.rolling_friction": 0.05, "box.walls": ["x-", "z+"]},
        1,
    ),
    "gravity_buoyancy_held": (
        COLLISION,
        {
            "gravity": GRAVITY,
            "fluid": FLUID,
            "drag": {"scheme": "held", "refresh": 1e-3, "carrier": "addforce"},
        },
        1,
    ),
    "grains_images_paraview": (
        COLLISION,
        {
            "title": GONE,
            "spheres": [*COLLISION["spheres"], GRAIN],
            "grains": GRAINS,
            "walls": {"youngs_modulus": 2e11},
            "box.walls": ["x+"],
            "output.images": 3,
            "output.paraview": True,
        },
        2,
    ),
    "piston_dry": (
        INFILTRATION,
        {"fluid": GONE, "pressure": GONE, "specimen.exit": "open"},
        4,
    ),
    "accelerating_exact_pore": (
        INFILTRATION,
        {
            "fluid.velocity_outside": "accelerating",
            "fluid.velocity_inside": "pore",
            "drag.scheme": "exact",
        },
        1,
    ),
    "piston_held": (INFILTRATION, {"drag.scheme": "held"}, 1),
    "continued": (INFILTRATION, {"drag.scheme": "implicit", "contact.friction": 0.2}, 1),
    "constant_implicit_pore": (
        INFILTRATION,
        {
            "fluid.velocity_outside": "constant",
            "fluid.velocity": 0.01,
            "fluid.velocity_inside": "pore",
            "drag.scheme": "implicit",
            "piston": GONE,
        },
        1,
    ),
    # Particles that relax within an interval; and a drag that is Stokes' all along.
    "piston_implicit_unresolved": (
        INFILTRATION,
        {
            "drag": {"scheme": "implicit", "refresh": 1.0},
            "time.duration": 10.0,
            "output.samples": 10,
        },
        1,
    ),
    # A gradient that goes to and fro: kept with the drag, and added at every step.
    "to_and_fro_held": (INFILTRATION, {"drag.scheme": "held", "pressure.period": 0.5}, 1),
    "to_and_fro_implicit": (
        COLLISION,
        {
            "fluid": {**FLUID, "viscosity": 1.0},
            "drag.scheme": "implicit",
            "pressure": {"gradient": 1.0, "period": 0.5},
        },
        1,
    ),
    "stokes_implicit": (
        COLLISION,
        {"fluid": {**FLUID, "viscosity": 1.0}, "drag.scheme": "implicit", "pressure.gradient": 1.0},
        1,
    ),
}  # fmt: skip

_NUMBER = re.compile(r"(?<![\w.])\d+\.?\d*(?:e[-+]?\d+)?(?![\w.])")


def without_last_digits(deck: str) -> str:
    """Every number with nine digits: what differs beyond them is rounding."""
    return _NUMBER.sub(lambda match: f"{float(match[0]):.9g}", deck)


def test_the_last_digits_do_not_count_and_the_others_do():
    one, near, far = (f"timestep 1.{'0' * zeros}1e-05 x9.1" for zeros in (12, 14, 6))
    assert without_last_digits(one) == without_last_digits(near)
    assert without_last_digits(one) != without_last_digits(far)


@pytest.mark.parametrize("name", DECKS)
def test_a_deck_is_as_it_was_last_looked_at(name):
    tables, changes, ranks = DECKS[name]
    changes = {key: value for key, value in changes.items() if key in tables or value is not GONE}
    case = case_of(tables, changes)
    if name == "continued":
        case = replace(case, checkpoint=Checkpoint(1, 1014, "segments/1/restart/step.1014", 0.02))
    files = deck_of(case, ranks).files
    parts = [f"\n# ==== {part}\n{files[part]}" for part in ("pieces.in", "checkpoint.in")]
    deck = "".join([files["deck.in"], *parts])
    deck = deck.replace(f"liggghts-driver {__version__}", "liggghts-driver VERSION")
    path = GOLDEN / f"{name}.deck.in"
    if os.environ.get("UPDATE_GOLDEN") == "1":
        path.write_text(deck, encoding="utf-8")
    golden = path.read_text(encoding="utf-8") if path.exists() else ""
    if without_last_digits(deck) == without_last_digits(golden):
        return
    diff = difflib.unified_diff(
        golden.splitlines(), deck.splitlines(), f"tests/golden/{path.name}", "now", lineterm=""
    )
    hint = "if this is meant: UPDATE_GOLDEN=1 pytest tests/test_deck_golden.py"
    pytest.fail("\n".join([*diff, hint]), pytrace=False)


def test_no_golden_deck_without_its_scene():
    assert {path.name for path in GOLDEN.iterdir()} == {f"{name}.deck.in" for name in DECKS}
