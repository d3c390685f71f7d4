"""An effect whose coefficient is zero changes nothing: decks with it and without it, run by run.

Every zero here leaves the trajectories equal to the last bit. Either the engine's own arithmetic
gives an exact 0 (the spring of friction, and that of rolling, is cut off at 0 x N; cohesion and
pressure multiply by 0), which leaves every sum as it is; or, where the engine or the scene takes no
zero (gravity without a direction, a fluid without viscosity), the coefficient is the least number
that a scene may hold, and what it adds is 1e-20 of the last bit of what is there.
"""

from __future__ import annotations

import itertools
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from decks import commands
from small_scenes import case_of, changed

from liggghts_driver.case import make_case
from liggghts_driver.deck.build import build_deck
from liggghts_driver.effects import EFFECTS, Decision, decide_effects
from liggghts_driver.engine.completion import missing_proofs
from liggghts_driver.engine.find import find_engine
from liggghts_driver.engine.launch import launch
from liggghts_driver.identity import scene_hash
from liggghts_driver.prepare import without
from liggghts_driver.results.positions import iter_instants
from liggghts_driver.results.thermo import read_thermo
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.written import write_deck

from .support import stepping

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from liggghts_driver.case import Case
    from liggghts_driver.deck.build import Deck
    from liggghts_driver.effects import Effect

    from .support import Tables

pytestmark = pytest.mark.engine

#: The least number other than 0 that a scene may hold.
LEAST = 1e-30
HALF = 0.012
FRAMES = 20


def crowd() -> Tables:
    """Spheres of three sizes that fly and spin between six walls, around a fixed grain.

    Each meets the others, the grain and the walls several times; every encounter multiplies what
    two runs differ by, so that a difference in the last bit would grow to be seen.
    """
    rng = np.random.default_rng(3)
    corners = np.array(list(itertools.product((-0.007, 0.007), repeat=3)))
    ways = rng.uniform(0.05, 0.3, size=(8, 3)) * rng.choice((-1.0, 1.0), size=(8, 3))
    spins = rng.uniform(-100.0, 100.0, size=(8, 3))
    spheres: list[dict[str, object]] = [
        {
            "radius": radius,
            "position": place.tolist(),
            "velocity": way.tolist(),
            "spin": spin.tolist(),
        }
        for radius, place, way, spin in zip(
            itertools.cycle((1.2e-3, 1.5e-3, 1.8e-3)), corners, ways, spins, strict=False
        )
    ]
    grain = {"kind": "grain", "radius": 4e-3, "position": [0.0, 0.0, 0.0]}
    return {
        "particles": {"density": 2500.0, "youngs_modulus": 1e7, "poissons_ratio": 0.25},
        "grains": {"youngs_modulus": 2e7, "poissons_ratio": 0.3},
        "spheres": [*spheres, grain],
        "contact": {"restitution": 0.9},
        "box": {
            "low": [-HALF] * 3,
            "high": [HALF] * 3,
            "walls": ["x-", "x+", "y-", "y+", "z-", "z+"],
        },
        **stepping(1e-5, 20000, FRAMES),
    }


@dataclass(frozen=True)
class Zero:
    """An effect at zero.

    Attributes
    ----------
    effect
        Its name.
    zero, felt
        Changes of the scene with which its coefficient is zero, and with which it is felt.
    around
        Changes that it needs to be anything at all.
    """

    effect: str
    zero: dict[str, Any]
    felt: dict[str, Any]
    around: dict[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Of the test: the effect, and the drag's scheme where it says one."""
        return "-".join([self.effect, *filter(None, [self.around.get("drag.scheme")])])


def fluid(density: float, viscosity: float) -> dict[str, float]:
    """A fluid at rest."""
    return {"density": density, "viscosity": viscosity}


def gravity(acceleration: float) -> dict[str, list[float]]:
    """Gravity along a direction of no symmetry."""
    return {"acceleration": [4.0 * acceleration, -3.0 * acceleration, -10.0 * acceleration]}


ZEROS = [
    Zero("friction", {}, {"contact.friction": 0.2}),
    Zero("rolling", {}, {"contact.rolling_friction": 0.1}, {"contact.friction": 0.2}),
    Zero("cohesion", {}, {"contact.cohesion_energy_density": 1e3}),
    Zero(
        "near_field",
        {"near_field": {"force": LEAST, "reach": 1e-3}},
        {"near_field": {"force": 1e-3, "reach": 1e-3}},
    ),
    Zero("rotation", {}, {"contact.friction": 0.2}),
    Zero("pressure", {"pressure": {"gradient": 0.0}}, {"pressure": {"gradient": 1.0}}),
    *(
        Zero(
            "drag",
            {"fluid": fluid(LEAST, LEAST)},
            {"fluid": fluid(1.0, 1e-4)},
            {"drag.scheme": scheme},
        )
        for scheme in ("exact", "held", "implicit")
    ),
    Zero("gravity", {"gravity": gravity(LEAST)}, {"gravity": gravity(0.01)}),
    Zero(
        "buoyancy",
        {"fluid": fluid(LEAST, 1e-3)},
        {"fluid": fluid(1.0, 1e-3)},
        {"drag.scheme": "none", "gravity": gravity(0.5)},
    ),
]
#: Effects that no coefficient takes to zero, and why.
WITHOUT_COEFFICIENT = {
    "contacts": "no deck is without them",
    "grains": "bodies, there or not",
    "walls": "bodies, there or not",
    "piston": "a body: at zero acceleration it is still a wall",
}


def test_every_effect_is_here() -> None:
    """A new effect needs a test of its zero, or a reason why it has none."""
    tested = {zero.effect for zero in ZEROS}
    assert tested | WITHOUT_COEFFICIENT.keys() == {effect.name for effect in EFFECTS}
    assert not tested & WITHOUT_COEFFICIENT.keys()


def effect_of(zero: Zero) -> Effect:
    """The effect itself."""
    (found,) = (effect for effect in EFFECTS if effect.name == zero.effect)
    return found


def put_in(case: Case, effect: Effect) -> Deck:
    """The deck of a case with an effect in it, whatever the effect decides by itself."""
    decisions = [
        Decision(effect, active=True, reason="at zero") if d.effect is effect else d
        for d in decide_effects(case.scene)
    ]
    return build_deck(case, scene_hash(case.identity), decisions=decisions)


def left_out(case: Case, effect: Effect) -> tuple[Case, Deck]:
    """The case and the deck of the same scene without the effect."""
    scene = case.scene if effect.without is None else without(case.scene, [effect])
    lean = make_case(scene)
    assert effect not in [d.effect for d in decide_effects(scene) if d.active]
    assert (lean.time.step_s, lean.time.steps) == (case.time.step_s, case.time.steps)
    return lean, build_deck(lean, scene_hash(lean.identity))


def simulate(case: Case, deck: Deck, folder: Path) -> NDArray[np.float64]:
    """Places and velocities in all frames of a run that is proven complete."""
    directory = RunDirectory(folder)
    write_deck(case, deck, directory)
    ended = launch(find_engine().command(1), directory.path, directory.stdout)
    thermo = read_thermo(directory.log)
    assert missing_proofs(case, deck.sentinel, directory, thermo, ended.returncode) == []
    instants = list(iter_instants(directory))
    return np.array([np.hstack([now.positions_m, now.velocities_m_s]) for now in instants])


def trajectories(runs: Sequence[tuple[Case, Deck]], root: Path) -> list[NDArray[np.float64]]:
    """Those of several decks, run side by side."""
    folders = [root / f"run-{number}" for number in range(len(runs))]
    with ThreadPoolExecutor(len(runs)) as pool:
        return list(pool.map(lambda run, folder: simulate(*run, folder), runs, folders))


@pytest.mark.parametrize("zero", ZEROS, ids=lambda zero: zero.name)
def test_at_zero_it_changes_nothing(zero: Zero, tmp_path: Path) -> None:
    effect = effect_of(zero)
    around = changed(crowd(), zero.around)
    case = case_of(around, zero.zero)
    felt = case_of(around, zero.felt)
    lean, lean_deck = left_out(case, effect)
    deck = put_in(case, effect)
    # Beyond the comments: the effect is in one deck and not in the other.
    assert commands(deck.files["deck.in"])[:-1] != commands(lean_deck.files["deck.in"])[:-1]
    runs = [(case, deck), (lean, lean_deck), (felt, build_deck(felt, scene_hash(felt.identity)))]
    there, not_there, strong = trajectories(runs, tmp_path)
    assert there.shape == (FRAMES + 1, 8, 6)
    assert np.array_equal(there, not_there)
    # The scene is one in which the effect is felt when it is not zero: by most of a radius.
    assert np.abs(strong - not_there)[-1, :, :3].max() > 1e-3
