"""A deck holds what its scene calls for and no trace of anything else, whatever is combined."""

from __future__ import annotations

import itertools
from collections import Counter

import pytest
from decks import commands, deck_of, ids, undefined_names, variables
from small_scenes import COLLISION, FLUID, GRAIN, INFILTRATION, case_of

GRAVITY = {"acceleration": [0.0, 0.0, -9.81]}
GRAINS = {"youngs_modulus": 1.0e7, "poissons_ratio": 0.25}

#: Switches of the collision scene: changes, and the words that then stand in the deck's commands.
SWITCHES = {
    "friction": ({"contact.friction": 0.3}, {"coefficientFriction", "history", "nve/sphere"}),
    "near_field": (
        {"near_field": {"force": 1e-6, "reach": 5e-4}},
        {"hybrid/overlay", "soft"},
    ),
    "cohesion": (
        {"contact.cohesion_energy_density": 1.0e4},
        {"cohesion", "cohesionEnergyDensity", "sjkr"},
    ),
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
        {"couple/cfd", "couple/cfd/force/implicit", "map", "Ksl", "largest_re2", "store/state"}
        | {"slip", "vector"},
    ),
    "held": (
        {"fluid": FLUID, "drag.scheme": "held"},
        {"couple/cfd", "couple/cfd/force", "map", "dragforce", "coefficient", "largest_re2"}
        | {"slip", "v_kept_x", "store/state", "vector"},
    ),
    "addforce": (
        {"fluid": FLUID, "drag.carrier": "addforce"},
        {"addforce", "v_drag_x", "dragforce", "coefficient", "largest_re2"}
        | {"slip", "v_kept_x", "store/state", "vector"},
    ),
    "exact": ({"fluid": FLUID, "drag.scheme": "exact"}, {"addforce", "v_drag_x", "largest_re2"}),
    "gravity": ({"gravity": GRAVITY}, {"vector"}),
    "soft": ({"particles.youngs_modulus": 1.0e6}, {"soft_particles"}),
    "hard": ({"walls": {"youngs_modulus": 2.0e11}}, {"hard_particles"}),
    "paraview": ({"output.paraview": True}, {"custom/vtk"}),
    "images": ({"output.images": 3}, {"image"}),
}
SCHEMES = {"implicit", "held", "addforce", "exact"}
KEPT = SCHEMES - {"exact"}
#: Words that only some combination brings.
TOGETHER = {
    "buoyancy": {frozenset({"gravity", drag}) for drag in SCHEMES},
    "epsd2": set(),
    "dragforce": {frozenset({"pressure", "implicit"})},
}
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
    if "pressure" in together and not KEPT & together:
        words.add("addforce")  # else the pressure is part of what the drag keeps
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
        **({"drag.carrier": scheme} if scheme == "addforce" else {"drag.scheme": scheme}),
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
    # K itself is kept by the implicit scheme alone, forces by the held one, with either carrier.
    assert ("Ksl" in words) == (scheme == "implicit")
    assert ("v_kept_x" in words) == (scheme in {"held", "addforce"})
    # The coupling, and what it asks for, stand there together.
    coupled = scheme in {"implicit", "held"}
    assert ("couple/cfd" in words) == ("map" in words) == coupled


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


@pytest.mark.parametrize(
    ("friction", "tangential", "after"),
    [({}, "off", ""),
     ({"contact.friction": 0.3}, "history", ""),
     ({"contact.friction": 0.3, "contact.rolling_friction": 0.1}, "history",
      " rolling_friction epsd2")],
    ids=["alone", "friction", "rolling"],
)  # fmt: skip
def test_cohesion_stands_where_the_engine_looks_for_it(friction, tangential, after):
    """After the tangential model and before that of rolling: any other order is refused."""
    changes = {"contact.cohesion_energy_density": 1.0e4, "box.walls": ["z-"], **friction}
    lines = commands(deck_of(case_of(COLLISION, changes)).files["deck.in"])
    model = f"model hertz tangential {tangential} cohesion sjkr{after}"
    assert f"pair_style gran {model}" in [" ".join(words) for words in lines]
    (wall,) = [" ".join(words) for words in lines if "wall/gran" in words]
    assert f"wall/gran {model} primitive" in wall


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


@pytest.mark.parametrize("carrier", ["coupling", "addforce"])
def test_a_held_force_has_one_carrier(carrier):
    """What adds the property ``dragforce`` to the forces: it exists once, and is added once."""
    case = case_of(INFILTRATION, {"drag.scheme": "held", "drag.carrier": carrier})
    deck = deck_of(case).files["deck.in"]
    fixes = [words for words in commands(deck) if words[0] == "fix"]
    styles = Counter(words[3] for words in fixes)
    properties = Counter(words[4] for words in fixes if words[3] == "property/atom")
    if carrier == "coupling":
        assert styles["couple/cfd"] == styles["couple/cfd/force"] == 1
        assert styles["addforce"] == properties["dragforce"] == 0
    else:
        assert "couple" not in deck
        assert "coupl" not in deck.split("# ---- 5.")[1]
        assert properties["dragforce"] == 1
        (added,) = [words[4:] for words in fixes if words[3] == "addforce"]
        known = variables(deck)
        assert [known[word.removeprefix("v_")] for word in added] == [
            "f_dragforce[1]", "f_dragforce[2]", "f_dragforce[3]",
        ]  # fmt: skip
    forces = [command for command in renewed(deck) if "dragforce" in command]
    assert forces == ["set group particles property/atom dragforce v_kept_x v_kept_y v_kept_z"]


def renewed(deck: str) -> list[str]:
    """The commands that the run gives again after every interval."""
    (run,) = [words for words in commands(deck) if words[0] == "run" and "pre" in words]
    return [word.strip('"') for word in run if word.startswith('"')]


def first(deck: str) -> list[str]:
    """The commands before the run."""
    return [" ".join(words) for words in commands(deck) if words[0] == "set"]


@pytest.mark.parametrize("scheme", ["held", "implicit"])
def test_what_is_kept_is_renewed_in_the_order_in_which_it_depends(scheme):
    deck = deck_of(case_of(INFILTRATION, {"drag.scheme": scheme})).files["deck.in"]
    last = {
        "held": [
            "coefficient v_kept_drag", "dragforce v_kept_x v_kept_y v_kept_z",
        ],
        "implicit": ["Ksl v_kept_drag"],
    }[scheme]  # fmt: skip
    expected = [
        # The slip needs the last velocity, which only then becomes the present one.
        "slip v_slip_x v_slip_y v_slip_z", "earlier v_now_x v_now_y v_now_z",
        "slip_re2 v_slip_re2", *last,
    ]  # fmt: skip
    again = renewed(deck)
    common = [c.removeprefix("set group particles property/atom ") for c in again if "group" in c]
    assert common == expected
    # The fluid where a particle is now, and the pressure there, before its slip.
    assert all("region" in command for command in again[: -len(expected)])
    assert len(again) == len(expected) + (4 if scheme == "implicit" else 0)
    # Before the run the same, after a last velocity that is the present one.
    assert first(deck) == [
        "set group particles property/atom earlier v_now_x v_now_y v_now_z", *again
    ]  # fmt: skip


def test_where_k_is_constant_the_implicit_scheme_renews_nothing():
    thick = {**FLUID, "viscosity": 1.0}
    changes = {"fluid": thick, "drag.scheme": "implicit", "pressure.gradient": 1.0}
    deck = deck_of(case_of(COLLISION, changes)).files["deck.in"]
    runs = [words for words in commands(deck) if words[0] == "run"]
    assert [len(words) for words in runs] == [2, 2]
    assert first(deck) == [
        "set group particles property/atom dragforce v_pressure_x v_zero v_zero",
        "set group particles property/atom Ksl v_kept_drag",
    ]
    assert not {"slip", "earlier", "slip_re2"} & set(ids(deck, "fix"))


def test_where_k_is_constant_a_held_force_is_renewed_and_its_coefficient_is_not():
    thick = {**FLUID, "viscosity": 1.0}
    changes = {"fluid": thick, "drag.scheme": "held"}
    deck = deck_of(case_of(COLLISION, changes)).files["deck.in"]
    coefficient = "set group particles property/atom coefficient v_kept_drag"
    assert coefficient in first(deck)
    assert first(deck).index(coefficient) < len(first(deck)) - 1
    assert coefficient not in renewed(deck)
    assert "dragforce" in renewed(deck)[-1]


def test_in_a_specimen_stokes_drag_is_renewed_in_what_depends_on_the_place():
    changes = {"fluid.viscosity": 10.0, "drag.scheme": "implicit"}
    again = renewed(deck_of(case_of(INFILTRATION, changes)).files["deck.in"])
    assert Counter(command.split()[4] for command in again) == {"uf": 2, "dragforce": 2}
    assert all("region" in command for command in again)


@pytest.mark.parametrize(("refresh", "extrapolated"), [(0.02, True), (1.0, False)])
def test_what_is_not_resolved_is_not_extrapolated(refresh, extrapolated):
    """The particles of this scene relax in 0.7 s: refreshed every second they have no trend."""
    changes = {
        "drag.scheme": "implicit", "drag.refresh": refresh, "time.duration": 10.0,
        "output.samples": 10,
    }  # fmt: skip
    case = case_of(INFILTRATION, changes)
    deck = deck_of(case).files["deck.in"]
    known = variables(deck)
    assert case.time.drag_resolved == extrapolated
    assert ("earlier" in ids(deck, "fix")) == ("now_x" in known) == extrapolated
    assert any("earlier" in command for command in first(deck) + renewed(deck)) == extrapolated
    assert_whole(deck)
    if not extrapolated:
        slips = [known[f"slip_{axis}"] for axis in "xyz"]
        assert slips == ["f_uf[1]-vx", "-vy", "-vz"]


def test_without_particles_and_coupling_there_is_no_coupling():
    changes = {"spheres": [GRAIN], "grains": GRAINS, "fluid": FLUID, "drag.carrier": "addforce"}
    assert "couple/cfd" not in words_of(deck_of(case_of(COLLISION, changes)).files["deck.in"])


def test_comments_speak_of_this_deck():
    """What is said of the implicit scheme stands in decks of that scheme only."""
    deck = deck_of(case_of(INFILTRATION, {"drag.scheme": "exact"})).files["deck.in"]
    assert "implicit" not in deck


def test_comments_of_the_held_scheme_speak_of_it():
    deck = deck_of(case_of(INFILTRATION, {"drag.scheme": "held"})).files["deck.in"]
    assert "implicit" not in deck
