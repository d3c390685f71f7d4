"""A deck holds what its scene calls for and no trace of anything else, whatever is combined."""

from __future__ import annotations

import itertools
from collections import Counter

import pytest
from decks import commands, deck_of, ids, undefined_names
from small_scenes import COLLISION, FLUID, GRAIN, INFILTRATION, case_of

GRAVITY = {"acceleration": [0.0, 0.0, -9.81]}
GRAINS = {"youngs_modulus": 1.0e7, "poissons_ratio": 0.25}

#: Switches of the collision scene: changes, and the words that then stand in the deck's commands.
SWITCHES = {
    "friction": ({"contact.friction": 0.3}, {"coefficientFriction", "history", "nve/sphere"}),
    "grains": (
        {"spheres": [*COLLISION["spheres"], GRAIN], "grains": GRAINS},
        {"freeze", "exclude"},
    ),
    "walls": ({"box.walls": ["x+", "z-"]}, {"primitive"}),
    "piston": (
        {"piston": {"acceleration": 2.0, "mass": 0.5}},
        {"mesh/surface/stress/servo", "$(f_piston[1])"},
    ),
    "pressure": ({"pressure": {"gradient": 10.0}}, {"pressure"}),
    "implicit": (
        {"fluid": FLUID, "drag.scheme": "implicit"},
        {"couple/cfd", "couple/cfd/force/implicit", "map", "Ksl", "largest_re2"},
    ),
    "held": (
        {"fluid": FLUID, "drag.scheme": "held"},
        {"coefficient", "v_drag_x", "largest_re2"},
    ),
    "exact": ({"fluid": FLUID, "drag.scheme": "exact"}, {"v_drag_x", "largest_re2"}),
    "gravity": ({"gravity": GRAVITY}, {"vector"}),
    "soft": ({"particles.youngs_modulus": 1.0e6}, {"soft_particles"}),
    "hard": ({"walls": {"youngs_modulus": 2.0e11}}, {"hard_particles"}),
    "paraview": ({"output.paraview": True}, {"custom/vtk"}),
    "images": ({"output.images": 3}, {"image"}),
}
#: Words that only some combination brings.
TOGETHER = {
    "buoyancy": {frozenset({"gravity", drag}) for drag in ("implicit", "held", "exact")},
    "epsd2": set(),
    "store/state": {frozenset({"implicit", "pressure"})},
    "addforce": {
        frozenset(pair)
        for pair in [{"held"}, {"exact"}, {"pressure", "exact"}, {"pressure", "held"}, {"pressure"}]
    },
}
SCHEMES = {"implicit", "held", "exact"}
PAIRS = [
    pair
    for pair in itertools.combinations(SWITCHES, 2)
    if len(SCHEMES & set(pair)) < 2
]  # fmt: skip


def words_of(deck: str) -> set[str]:
    """Every word of every command, formulas and names taken apart at their blanks."""
    return {part for line in commands(deck) for word in line for part in word.strip('"').split()}


def changes_of(switches) -> dict:
    return {key: value for name in switches for key, value in SWITCHES[name][0].items()}


def expected(switches) -> set[str]:
    words = set().union(*(SWITCHES[name][1] for name in switches)) if switches else set()
    together = frozenset(switches)
    for word, combinations in TOGETHER.items():
        if any(combination <= together for combination in combinations):
            words.add(word)
    if together >= {"implicit", "pressure"} and not SCHEMES & (together - {"implicit"}):
        words.discard("addforce")  # the implicit drag carries the pressure
    return words


EVERYTHING = set().union(*(words for _, words in SWITCHES.values()), TOGETHER)


@pytest.mark.parametrize(
    "switches", [(), *((name,) for name in SWITCHES), *PAIRS], ids=lambda names: "+".join(names)
)
def test_a_deck_has_the_words_of_its_effects_and_of_no_other(switches):
    deck = deck_of(case_of(COLLISION, changes_of(switches))).files["deck.in"]
    found = words_of(deck)
    assert found & EVERYTHING == expected(switches)
    assert_whole(deck)


def assert_whole(deck: str) -> None:
    """Nothing is used that is not defined, nothing is defined twice."""
    assert not [
        f"{use.kind}_{use.name} in {' '.join(use.command)}" for use in undefined_names(deck)
    ]
    for kind in ("fix", "compute", "variable", "region", "group", "dump"):
        twice = [name for name, count in Counter(ids(deck, kind)).items() if count > 1]
        assert not twice, f"{kind} {twice} defined twice"


OUTSIDE = ["piston", "accelerating", "constant", "still"]


@pytest.mark.parametrize("scheme", sorted(SCHEMES))
@pytest.mark.parametrize("outside", OUTSIDE)
@pytest.mark.parametrize("inside", ["still", "pore"])
@pytest.mark.parametrize("pressure", [{"pressure.gradient": 10.0}, {"pressure.gradient": -3.0}])
def test_a_whole_deck_for_every_fluid(scheme, outside, inside, pressure):
    changes = {
        "drag.scheme": scheme,
        "fluid.velocity_outside": outside,
        "fluid.velocity_inside": inside,
        "fluid.velocity": 0.01,
        **pressure,
    }
    case = case_of(INFILTRATION, changes)
    deck = deck_of(case)
    assert_whole(deck.files["deck.in"])
    words = words_of(deck.files["deck.in"])
    # The piston's velocity is followed only where the fluid moves with it.
    assert ("ave/time" in words) == (outside == "piston")
    # Coefficients are renewed between intervals by the implicit scheme alone.
    assert ("Ksl" in words) == (scheme == "implicit")


def test_the_sentinel_is_the_last_command_and_stands_there_once():
    deck = deck_of(case_of(COLLISION))
    lines = commands(deck.files["deck.in"])
    assert lines[-1] == ["print", f'"{deck.sentinel}"']
    assert deck.sentinel.endswith("0" * 12)
    assert deck.files["deck.in"].count(deck.sentinel) == 1


def test_columns_are_named_for_every_value():
    for tables in (COLLISION, INFILTRATION):
        deck = deck_of(case_of(tables)).files["deck.in"]
        (series,) = [words for words in commands(deck) if words[:2] == ["fix", "series"]]
        values, names = series[5].strip('"').split(), series[-1].strip('"').split()
        assert len(values) == len(names) == len(set(names))
        assert names[0] == "step"
    assert names == [
        "step", "kinetic_energy_j", "largest_speed_m_s", "inside", "flowing",
        "flow_velocity_sum_m_s", "volume_past_entrance_m3", "volume_past_middle_m3",
        "piston_x_m", "piston_force_n", "largest_reynolds_squared",
    ]  # fmt: skip


def test_files_of_a_deck():
    assert set(deck_of(case_of(COLLISION)).files) == {"deck.in", "particles.data"}
    assert set(deck_of(case_of(INFILTRATION)).files) == {"deck.in", "particles.data", "piston.stl"}


def test_numbers_of_the_plan_stand_in_the_deck():
    case = case_of(INFILTRATION)
    lines = {words[0]: words for words in commands(deck_of(case).files["deck.in"])}
    assert float(lines["timestep"][1]) == case.time.step_s
    assert lines["thermo"][1] == str(case.time.sample_every)
    assert lines["run"][1] == str(case.time.steps)
    assert lines["run"][lines["run"].index("every") + 1] == str(case.time.refresh_every)
    assert float(lines["neighbor"][1]) == case.skin_m


@pytest.mark.parametrize(
    ("ranks", "grid"), [(2, "1 2 1"), (3, "1 3 1"), (4, "1 2 2"), (6, "1 3 2"), (7, "1 7 1")]
)
def test_ranks_cut_the_channel_across_and_never_along_the_flow(ranks, grid):
    lines = commands(deck_of(case_of(INFILTRATION), ranks).files["deck.in"])
    assert ["processors", *grid.split()] in lines


def test_one_rank_needs_no_grid_and_a_box_is_cut_by_the_engine():
    assert "processors" not in words_of(deck_of(case_of(INFILTRATION)).files["deck.in"])
    lines = commands(deck_of(case_of(COLLISION), 2).files["deck.in"])
    assert ["processors", "*", "*", "*"] in lines


def test_rolling_resistance_stands_in_the_contact_model():
    changes = {"contact.friction": 0.3, "contact.rolling_friction": 0.1}
    lines = commands(deck_of(case_of(COLLISION, changes)).files["deck.in"])
    model = "pair_style gran model hertz tangential history rolling_friction epsd2"
    assert model in [" ".join(words) for words in lines]


def test_walls_and_piston_have_the_contact_model_of_the_spheres():
    changes = {"contact.friction": 0.3, "contact.rolling_friction": 0.1}
    lines = commands(deck_of(case_of(INFILTRATION, changes)).files["deck.in"])
    model = "model hertz tangential history rolling_friction epsd2"
    walls = [" ".join(words) for words in lines if "wall/gran" in words]
    assert len(walls) == 6  # five walls and the piston
    assert all(f"wall/gran {model}" in wall for wall in walls)


def test_a_long_thin_box_has_a_picture_too():
    box = {"low": [-2.0, -0.0004, -0.0004], "high": [2.0, 0.0004, 0.0004]}
    spheres = [{"radius": 0.0002, "position": [0.0, 0.0, 0.0]}]
    case = case_of(COLLISION, {"box": box, "spheres": spheres, "output.images": 2})
    assert " image " in deck_of(case).files["deck.in"]


def test_comments_speak_of_this_deck():
    """What is said of the implicit scheme stands in decks of that scheme only."""
    deck = deck_of(case_of(INFILTRATION, {"drag.scheme": "exact"})).files["deck.in"]
    assert "implicit" not in deck


def test_comments_of_the_held_scheme_speak_of_it():
    deck = deck_of(case_of(INFILTRATION, {"drag.scheme": "held"})).files["deck.in"]
    assert "implicit" not in deck
