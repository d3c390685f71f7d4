"""A deck holds what its scene calls for and no trace of anything else, whatever is combined."""

from __future__ import annotations

import itertools
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING

import pytest
from decks import (
    commands,
    deck_of,
    followed,
    ids,
    piece_steps,
    taken_up,
    undefined_names,
    variables,
    whole,
)
from small_scenes import COLLISION, FLUID, GONE, GRAIN, INFILTRATION, case_of

from liggghts_driver.deck import build

if TYPE_CHECKING:
    from liggghts_driver.case import Case
    from liggghts_driver.deck.build import Deck

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
        {"mesh/surface/stress/servo", "$(f_piston[1])", "ave/time"},
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
#: What every deck has that starts, that is taken up, or that makes a checkpoint; and what these
#: have of an effect.
ALWAYS = {
    "start": {"read_data"},
    "resumed": {"read_restart", "store/state", "v_full_x", "v_start_x"},
    "checkpoint": {"write_restart", "store/state", "v_half_x"},
}
KEPT_OF_EFFECTS = {
    "start": {},
    "resumed": {
        "friction": {"omegax", "v_spin_full_x", "v_spin_start_x"},
        "piston": {"v_piston_target", "force_dt_reset", "reset_timestep"},
    },
    "checkpoint": {
        "friction": {"omegax", "v_spin_half_x"},
        "piston": {"$(v_piston_velocity)"},
    },
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


def kept_of(kind: str, switches) -> set[str]:
    return ALWAYS[kind].union(*(KEPT_OF_EFFECTS[kind].get(name, set()) for name in switches))


EVERYTHING = set().union(
    *(words for _, words in SWITCHES.values()),
    TOGETHER,
    *ALWAYS.values(),
    *(words for effects in KEPT_OF_EFFECTS.values() for words in effects.values()),
)


@pytest.mark.parametrize(
    "switches", [(), *((name,) for name in SWITCHES), *PAIRS], ids=lambda names: "+".join(names)
)
def test_a_deck_has_the_words_of_its_effects_and_of_no_other(switches):
    case = case_of(COLLISION, changes_of(switches))
    start, resumed = deck_of(case), deck_of(taken_up(case))
    wanted = expected(switches)
    assert words_of(stepping(start)) & EVERYTHING == wanted | kept_of("start", switches)
    if "implicit" in switches:
        wanted -= {"dragforce"}  # set once at the start, if at all, and part of the restart file
    assert words_of(stepping(resumed)) & EVERYTHING == wanted | kept_of("resumed", switches)
    for deck in (start, resumed):
        checkpoint = words_of(deck.files["checkpoint.in"])
        assert checkpoint & EVERYTHING == kept_of("checkpoint", switches)
        assert_whole(deck)


def stepping(deck: Deck) -> str:
    """What the engine reads of a deck when nobody asks for a checkpoint."""
    return deck.files["deck.in"] + deck.files["pieces.in"]


def assert_whole(deck: Deck) -> None:
    """Nothing is used that is not defined, nothing is defined twice."""
    for text in (stepping(deck), whole(deck)):
        assert not [
            f"{use.kind}_{use.name} in {' '.join(use.command)}" for use in undefined_names(text)
        ]
    for kind in ("fix", "compute", "variable", "region", "group", "dump"):
        twice = [name for name, count in Counter(ids(whole(deck), kind)).items() if count > 1]
        assert not twice, f"{kind} {twice} defined twice"
    read = [w[1] for w in commands(whole(deck)) if w[0] in {"jump", "read_data"}]
    assert set(read) <= set(deck.files)


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
    for deck in (deck_of(case), deck_of(taken_up(case))):
        assert_whole(deck)
        assert_drag_and_piston(deck, scheme, outside)


def assert_drag_and_piston(deck: Deck, scheme: str, outside: str) -> None:
    words, known = words_of(stepping(deck)), variables(stepping(deck))
    fixes = ids(stepping(deck), "fix")
    # The piston's velocity is in every checkpoint, and followed only where the fluid moves with it.
    assert {"piston_velocity", "piston_force", "piston_steps"} <= set(known)
    assert "piston_mean" in fixes
    follows = any("v_piston_velocity" in formula for formula in known.values())
    assert follows == (outside == "piston")
    # It is looked ahead only for what is kept.
    ahead = outside == "piston" and scheme in KEPT
    assert ("piston_recent" in fixes) == ("piston_acceleration" in known) == ahead
    assert any("v_piston_acceleration" in formula for formula in known.values()) == ahead
    # K itself is kept by the implicit scheme alone, forces by the held one, with either carrier.
    assert ("Ksl" in words) == (scheme == "implicit")
    assert ("v_kept_x" in words) == (scheme in {"held", "addforce"})
    # The coupling, and what it asks for, stand there together.
    coupled = scheme in {"implicit", "held"}
    assert ("couple/cfd" in words) == ("map" in words) == coupled


#: Runs whose pieces are those of a sample, and such with pieces between two refreshes.
RUNS = {
    "collision": (COLLISION, {}),
    "friction": (COLLISION, {"contact.friction": 0.3}),
    "short": (COLLISION, {"fluid": FLUID, "drag.scheme": "held", "drag.refresh": 1e-3}),
    "piston": (INFILTRATION, {"fluid": GONE, "pressure": GONE}),
    "exact": (INFILTRATION, {"drag.scheme": "exact", "contact.friction": 0.3}),
    "held": (INFILTRATION, {"drag.scheme": "held"}),
    "implicit": (INFILTRATION, {"drag.scheme": "implicit", "contact.friction": 0.3}),
}
of_runs = pytest.mark.parametrize("name", RUNS)


def run_case_of(name: str) -> Case:
    return case_of(*RUNS[name])


def steps_of(lines: list[list[str]]) -> int:
    """The steps that the engine makes once it has come to the pieces."""
    begun = lines.index(["jump", "pieces.in"])
    return sum(int(words[1]) for words in lines[begun:] if words[0] == "run")


@of_runs
def test_pieces_make_up_the_run(name):
    case = run_case_of(name)
    deck = deck_of(case)
    lines = followed(deck)
    length = piece_steps(deck)
    pieces = [words for words in lines if words[:2] == ["run", str(length)]]
    assert len(pieces) * length == steps_of(lines) == case.time.steps
    # No setup in between: it would compute the forces anew, from other velocities.
    assert all(words[2:4] == ["pre", "no"] for words in pieces)
    # A sample, a frame or a refresh falls on the end of a piece.
    plan = case.time
    assert {n % length for n in (plan.sample_every, plan.frame_every, plan.steps)} == {0}
    assert length == plan.refresh_every or not plan.keeps_drag
    # Before the pieces nothing moves.
    before = lines[: lines.index(["jump", "pieces.in"])]
    assert {words[1] for words in before if words[0] == "run"} == {"0"}


@of_runs
@pytest.mark.parametrize("number", [1, 3, "last but one"])
def test_a_resumed_run_makes_the_steps_that_are_left(name, number):
    case = run_case_of(name)
    length = piece_steps(deck_of(case))
    done = case.time.steps // length - 1 if number == "last but one" else number
    resumed = taken_up(case, done)
    deck = deck_of(resumed)
    lines = followed(deck)
    assert piece_steps(deck) == length
    assert resumed.checkpoint.step == done * length
    assert steps_of(lines) == case.time.steps - resumed.checkpoint.step
    assert lines[-1] == ["print", f'"{deck.sentinel}"']


@pytest.mark.parametrize("most", [1, 10, 60, 10**9])
def test_a_piece_does_not_last_long(most, monkeypatch):
    """Particles times steps are bounded, and samples still fall on the ends of pieces."""
    monkeypatch.setattr(build, "_PIECE_PARTICLE_STEPS", most)
    case = case_of(COLLISION, {"time.step": 1e-4})
    interval, allowed = case.time.sample_every, max(1, most // len(COLLISION["spheres"]))
    assert interval == 50
    divisors = [1, 2, 5, 10, 25, 50]
    length = piece_steps(deck_of(case))
    assert length == max(n for n in divisors if n <= allowed)
    assert steps_of(followed(deck_of(case))) == case.time.steps


@of_runs
def test_the_sentinel_is_the_last_command_and_stands_there_once(name):
    deck = deck_of(run_case_of(name))
    lines = followed(deck)
    assert lines[-1] == ["print", f'"{deck.sentinel}"']
    assert deck.sentinel.endswith("0" * 12)
    assert "".join(deck.files.values()).count(deck.sentinel) == 1
    assert [words[0] for words in lines].count("print") == 1
    assert deck.mark not in stepping(deck)
    assert not {"write_restart", "quit"} & {words[0] for words in lines}


def test_a_last_frame_between_two_is_written_before_the_sentinel():
    """Only where the frames' interval does not end with the run, and at its end alone."""
    case = case_of(COLLISION)
    assert "write_dump" not in words_of(whole(deck_of(case)))
    more = replace(case.time, steps=case.time.steps + case.time.sample_every)
    lines = followed(deck_of(replace(case, time=more)))
    assert [words[0] for words in lines].count("write_dump") == 1
    assert lines[-2][:4] == ["write_dump", "particles", "custom", last_frame(more.steps)]


def last_frame(step: int) -> str:
    return f"dumps/particles.{step:010d}.bin"


@of_runs
@pytest.mark.parametrize("piece", [1, 2, -1])
def test_a_checkpoint_is_made_at_the_end_of_the_piece_in_which_it_is_asked_for(name, piece):
    case = run_case_of(name)
    deck = deck_of(case)
    length = piece_steps(deck)
    piece = piece if piece > 0 else case.time.steps // length - 1
    lines = followed(deck, asked=piece)
    assert steps_of(lines) == piece * length
    assert lines[-1] == ["quit"]
    velocity = "$(v_piston_velocity)" if case.scene.piston else "0"
    assert [words for words in lines if words[0] == "print"] == [
        ["print", f'"{deck.mark} $(step) {velocity}"']
    ]
    assert deck.mark.endswith("checkpoint " + "0" * 12)
    # It has what is renewed for the next piece.
    at, again = max(n for n, words in enumerate(lines) if words[0] == "next"), renewed(deck)
    assert [" ".join(words) for words in lines[at - len(again) : at]] == again
    assert lines[at - len(again) - 1][:2] == ["run", str(length)]
    # And the run goes on from there.
    rest = followed(deck_of(taken_up(case, piece)))
    assert steps_of(lines) + steps_of(rest) == case.time.steps


@of_runs
def test_the_commands_of_a_checkpoint(name):
    """The velocities of now are stored, then those of half a step ago written, then nothing."""
    deck = deck_of(run_case_of(name))
    turns = "contact.friction" in RUNS[name][1]
    lines = [words for words in commands(deck.files["checkpoint.in"]) if words[0] != "variable"]
    stored = ["fix full_1 particles store/state 0 vx vy vz"]
    halved = ["set group particles vx v_half_x vy v_half_y vz v_half_z"]
    if turns:
        stored.append("fix spin_full_1 particles store/state 0 omegax omegay omegaz")
        halved.append(
            "set group particles omegax v_spin_half_x omegay v_spin_half_y omegaz v_spin_half_z"
        )
    told = [" ".join(words) for words in lines]
    assert told[:-2] == [*stored, *halved, "write_restart restart/step.*.restart"]
    assert [words[0] for words in lines[-2:]] == ["print", "quit"]


@of_runs
def test_a_resumed_run_begins_with_what_the_restart_file_has(name):
    case = taken_up(run_case_of(name), 2)
    deck, then = deck_of(case), case.checkpoint
    turns = "contact.friction" in RUNS[name][1]
    step = f"timestep {case.time.step_s!r}"
    wanted = [f"read_restart {then.restart}", step]
    wanted += stored_again(2, "", "vx vy vz")
    wanted += stored_again(2, "spin_", "omegax omegay omegaz") if turns else []
    if case.scene.piston:
        # It gets its velocity in two steps that end where the run goes on, and last no time.
        back = f"reset_timestep {then.step - 2}"
        wanted += ["force_dt_reset yes", back, "timestep 1e-20", "run 2 post no", step]
    # The forces of the checkpoint, from the velocities of half a step before it.
    wanted += ["run 0 post no", *set_to("full", turns=turns)]
    # What is counted and kept at that step has its velocities; then the coming half kick's.
    wanted += ["run 0 pre no post no", *set_to("start", turns=turns)]
    left = case.time.steps - then.step
    wanted += [f"variable piece loop {left // piece_steps(deck)}", "jump pieces.in"]
    assert [
        line for line in map(" ".join, commands(deck.files["deck.in"])) if moves(line)
    ] == wanted


def stored_again(number: int, spin: str, words: str) -> list[str]:
    return [f"fix {spin}{at}_{number} particles store/state 0 {words}" for at in ("full", "half")]


def set_to(at: str, *, turns: bool) -> list[str]:
    kinds = [("v", ""), *([("omega", "spin_")] if turns else [])]
    return [
        "set group particles " + " ".join(f"{word}{a} v_{spin}{at}_{a}" for a in "xyz")
        for word, spin in kinds
    ]


def moves(line: str) -> bool:
    """Whether a command reads or sets what moves, or steps."""
    words = line.split()
    read = {"read_restart", "read_data", "timestep", "reset_timestep", "force_dt_reset"}
    stores = "store/state" in words and not {"v_stokes", "v_pressure", "v_re2_per_slip2"} & {*words}
    return words[0] in {*read, "run", "set", "jump"} or stores or "loop" in words


@of_runs
def test_names_of_a_checkpoint_are_its_own(name):
    """A restart file has the fixes of all decks before it, and gives them to what is called so."""
    case = run_case_of(name)
    before = deck_of(case)
    in_file: set[str] = set()
    for number in (1, 2, 3):
        made = ids(before.files["checkpoint.in"], "fix")
        in_file |= {*ids(before.files["deck.in"], "fix"), *made}
        resumed = deck_of(taken_up(case, number))
        fixes = {words[1]: words for words in commands(whole(resumed)) if words[0] == "fix"}
        # What the checkpoint has stored, is found again.
        for words in commands(before.files["checkpoint.in"]):
            assert words[0] != "fix" or fixes[words[1]] == words
        # What is the velocity of half a step before, is not found there, nor is the next one.
        new = {*ids(resumed.files["checkpoint.in"], "fix")}
        new |= {fix.replace("full", "half") for fix in made}
        assert new <= set(fixes)
        assert not new & in_file
        assert len(new) == 2 * len(made)
        before = resumed


@pytest.mark.parametrize("name", ["collision", "held"])
def test_a_checkpoint_that_is_asked_for_in_the_last_piece_comes_too_late(name):
    """The run is whole then; a deck that went on from there would have nothing to do."""
    case = run_case_of(name)
    deck = deck_of(case)
    last = case.time.steps // piece_steps(deck)
    assert followed(deck, asked=last)[-1] == ["print", f'"{deck.sentinel}"']


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
    scripts = {"deck.in", "pieces.in", "control.in", "checkpoint.in"}
    assert set(deck_of(case_of(COLLISION)).files) == {*scripts, "particles.data"}
    case = case_of(INFILTRATION)
    assert set(deck_of(case).files) == {*scripts, "particles.data", "piston.stl"}
    # The particles are in the restart file; the piston's place is, its shape is not.
    assert set(deck_of(taken_up(case)).files) == {*scripts, "piston.stl"}
    assert commands(deck_of(case).files["control.in"]) == [["jump", "pieces.in"]]


def test_numbers_of_the_plan_stand_in_the_deck():
    case = case_of(INFILTRATION)
    deck = deck_of(case)
    lines = {words[0]: words for words in commands(deck.files["deck.in"])}
    assert float(lines["timestep"][1]) == case.time.step_s
    assert lines["thermo"][1] == str(case.time.sample_every)
    assert float(lines["neighbor"][1]) == case.skin_m
    (run,) = [words for words in commands(deck.files["pieces.in"]) if words[0] == "run"]
    assert run == ["run", str(case.time.refresh_every), "pre", "no", "post", "no"]
    (loop,) = [words for words in commands(deck.files["deck.in"]) if "loop" in words]
    assert int(loop[-1]) * case.time.refresh_every == case.time.steps


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
    scripts = deck_of(case)
    deck = stepping(scripts)
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
    forces = [command for command in renewed(scripts) if "dragforce" in command]
    assert forces == ["set group particles property/atom dragforce v_kept_x v_kept_y v_kept_z"]


def renewed(deck: Deck) -> list[str]:
    """The commands that follow on every piece of the run."""
    run, *rest = commands(deck.files["pieces.in"])
    assert run[0] == "run"
    end = next(n for n, words in enumerate(rest) if words[0] != "set")
    assert not [words for words in rest[end:] if words[0] == "set"]
    assert ["jump", "control.in"] in rest[end:]
    return [" ".join(words) for words in rest[:end]]


def first(deck: Deck) -> list[str]:
    """The commands before the run: what they set counts in the forces with which it begins."""
    lines = [" ".join(words) for words in commands(deck.files["deck.in"])]
    begin, end = lines.index("run 0 post no"), lines.index("run 0")
    between = lines[begin + 1 : end]
    assert [line for line in lines if line.startswith("set ")] == between
    return between


@pytest.mark.parametrize("scheme", ["held", "implicit"])
def test_what_is_kept_is_renewed_in_the_order_in_which_it_depends(scheme):
    case = case_of(INFILTRATION, {"drag.scheme": scheme})
    deck = deck_of(case)
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
    # A checkpoint has all that is kept.
    resumed = deck_of(taken_up(case))
    assert renewed(resumed) == again
    lines = commands(resumed.files["deck.in"])
    assert not [words for words in lines if words[0] == "set" and "property/atom" in words]
    restarted = [words[6] for words in lines if words[0] == "fix" and words[3] == "property/atom"]
    assert set(restarted) == {"yes"}


def test_where_k_is_constant_the_implicit_scheme_renews_nothing():
    thick = {**FLUID, "viscosity": 1.0}
    changes = {"fluid": thick, "drag.scheme": "implicit", "pressure.gradient": 1.0}
    deck = deck_of(case_of(COLLISION, changes))
    runs = [words for words in commands(deck.files["deck.in"]) if words[0] == "run"]
    assert runs == [["run", "0", "post", "no"], ["run", "0"]]
    assert renewed(deck) == []
    assert first(deck) == [
        "set group particles property/atom dragforce v_pressure_x v_zero v_zero",
        "set group particles property/atom Ksl v_kept_drag",
    ]
    assert not {"slip", "earlier", "slip_re2"} & set(ids(whole(deck), "fix"))


def test_where_k_is_constant_a_held_force_is_renewed_and_its_coefficient_is_not():
    thick = {**FLUID, "viscosity": 1.0}
    changes = {"fluid": thick, "drag.scheme": "held"}
    deck = deck_of(case_of(COLLISION, changes))
    coefficient = "set group particles property/atom coefficient v_kept_drag"
    assert coefficient in first(deck)
    assert first(deck).index(coefficient) < len(first(deck)) - 1
    assert coefficient not in renewed(deck)
    assert "dragforce" in renewed(deck)[-1]


def test_in_a_specimen_stokes_drag_is_renewed_in_what_depends_on_the_place():
    changes = {"fluid.viscosity": 10.0, "drag.scheme": "implicit"}
    again = renewed(deck_of(case_of(INFILTRATION, changes)))
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
    deck = deck_of(case)
    known = variables(whole(deck))
    assert case.time.drag_resolved == extrapolated
    assert ("earlier" in ids(whole(deck), "fix")) == ("now_x" in known) == extrapolated
    assert any("earlier" in command for command in first(deck) + renewed(deck)) == extrapolated
    assert_whole(deck)
    if not extrapolated:
        slips = [known[f"slip_{axis}"] for axis in "xyz"]
        assert slips == ["f_uf[1]-vx", "-vy", "-vz"]


def test_without_particles_and_coupling_there_is_no_coupling():
    changes = {"spheres": [GRAIN], "grains": GRAINS, "fluid": FLUID, "drag.carrier": "addforce"}
    assert "couple/cfd" not in words_of(whole(deck_of(case_of(COLLISION, changes))))


def test_comments_speak_of_this_deck():
    """What is said of the implicit scheme stands in decks of that scheme only."""
    deck = deck_of(case_of(INFILTRATION, {"drag.scheme": "exact"}))
    assert "implicit" not in whole(deck)


def test_comments_of_the_held_scheme_speak_of_it():
    deck = deck_of(case_of(INFILTRATION, {"drag.scheme": "held"}))
    assert "implicit" not in whole(deck)
