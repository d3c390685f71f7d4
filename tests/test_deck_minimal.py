"""Adding an effect to a deck adds its own lines and words, and changes nothing else.

The case has everything; decks are written with some of its effects, so that two decks differ by
what an effect writes and not by a step or a seed.
"""

from __future__ import annotations

import functools
import itertools
import re
from collections import Counter

import pytest
from decks import taken_up, whole
from small_scenes import FLUID, INFILTRATION, case_of

from liggghts_driver.deck.build import build_deck
from liggghts_driver.deck.render import render
from liggghts_driver.effects import EFFECTS, Decision

NAMES = [effect.name for effect in EFFECTS]
BY_NAME = {effect.name: effect for effect in EFFECTS}
#: The problem's own frame: without them its walls have no stiffness or its spheres no type.
FRAME = {"contacts"}
PAIRS = [
    (one, other)
    for one, other in itertools.permutations(NAMES, 2)
    if one not in FRAME and other not in FRAME
]


@functools.cache
def full_case():
    return case_of(
        INFILTRATION,
        {
            "fluid": {**FLUID, "velocity_outside": "piston"},
            "gravity": {"acceleration": [0.0, 0.0, -9.81]},
            "contact.friction": 0.3,
            "contact.rolling_friction": 0.05,
            "contact.cohesion_energy_density": 10.0,
            "near_field": {"force": 1e-6, "reach": 5e-4},
        },
    )


STARTS = ["start", "resumed"]


@functools.cache
def case_from(start: str):
    return full_case() if start == "start" else taken_up(full_case())


@functools.cache
def deck(start: str, *names: str) -> tuple[str, ...]:
    decisions = [Decision(effect, effect.name in {*FRAME, *names}, "chosen") for effect in EFFECTS]
    written = build_deck(case_from(start), "0" * 64, decisions=decisions)
    return tuple(whole(written).splitlines())


@functools.cache
def own_lines(start: str, name: str) -> Counter[str]:
    """What the effect's fragment says in this case, contact words of the deck aside."""
    effect, case = BY_NAME[name], case_from(start)
    lines = render(effect.fragment(case), {"effect": effect.values(case), "contact_words": "WORDS"})
    return Counter(lines.splitlines())


def without_words(line: str, name: str) -> str:
    """The line as it would be if the effect had no words in it."""
    effect, case = BY_NAME[name], full_case()
    words = " ".join(effect.contact_words)
    if words and words in line:
        default = " tangential off" if effect.contact_words[0] == "tangential" else ""
        line = line.replace(f" {words}", default)
    for column in effect.columns(case):
        line = line.replace(f"$({column.engine}) ", "").replace(f" $({column.engine})", "")
        line = line.replace(f"{column.name} ", "").replace(f" {column.name}", "")
    return line


def test_the_case_has_every_effect():
    assert all(effect.decide(full_case().scene)[0] for effect in EFFECTS)


@pytest.mark.parametrize("start", STARTS)
@pytest.mark.parametrize(("name", "other"), PAIRS)
def test_adding_one_changes_its_own_lines_alone(name, other, start):
    before, after = Counter(deck(start, other)), Counter(deck(start, other, name))
    added, removed = after - before, before - after
    mine = own_lines(start, name)
    foreign = []
    for line in added.elements():
        told = line == f"#   {BY_NAME[name].title}: chosen"
        heading = line == "" or line.startswith(("# ---- ", "# Effects"))
        # A wall's line holds the contact model's words, which are those of the deck.
        model = next((ln for ln in deck(start, other, name) if ln.startswith("pair_style")), "")
        words = model.split("gran ", 1)[1].split(" soft ")[0].strip()
        in_fragment = line in mine or line.replace(words, "WORDS") in mine
        changed = without_words(line, name) in removed
        if not (told or heading or in_fragment or changed or is_shared(line, name)):
            foreign.append(line)
    assert not foreign
    gone = [
        line
        for line in removed.elements()
        if not any(without_words(new, name) == line for new in added) and not is_shared(line, name)
    ]
    assert not gone


def is_shared(line: str, name: str) -> bool:
    """Lines of the deck's frame that follow from an effect by the effect's own name."""
    if name == "near_field":  # it is laid over the contacts
        return line.startswith(("pair_style      hybrid", "pair_style      gran", "pair_coeff"))
    if name == "rotation":  # what turns is stored in a checkpoint, and taken up from it
        return re.match(r"fix +motion|fix +spin_|variable +spin_|set .* omegax", line) is not None
    refreshes = BY_NAME[name].refresh(full_case())
    if refreshes is not None:
        # The forces before the run are computed again, and told of only then.
        runs = re.fullmatch(r"run +(0|0 post no|\d+ pre no post (yes|no))", line) is not None
        return runs or line in {*refreshes.once, *refreshes.again}
    return False


#: What the checkpoint, and a fluid that moves with the piston, have of it by the scene alone: only
#: here a deck is without the piston that its scene has.
OF_THE_SCENE = {"piston": {"piston_velocity", "piston_acceleration"}}


@pytest.mark.parametrize("start", STARTS)
@pytest.mark.parametrize("name", [name for name in NAMES if name not in FRAME])
def test_without_it_there_is_no_trace(name, start):
    """Of an effect that is out no fix, no property, no variable and no column is left."""
    others = [other for other in NAMES if other != name and name not in BY_NAME[other].needs]
    text = "\n".join(line.split("#")[0] for line in deck(start, *others))
    defined = {
        line.split()[1]
        for line in own_lines(start, name)
        if line.startswith(("fix ", "variable ", "compute ", "region "))
    }
    shared = {
        line.split()[1]
        for other in others
        for line in own_lines(start, other)
        if line.startswith(("fix ", "variable ", "compute ", "region "))
    }
    words = set(text.split())
    for identifier in defined - shared:
        assert identifier not in words
        if identifier not in OF_THE_SCENE.get(name, set()):
            assert not re.search(rf"\b[vfc]_{identifier}\b", text)
    for column in BY_NAME[name].columns(full_case()):
        assert column.name not in text
        assert f"$({column.engine})" not in text
    assert f"#   {BY_NAME[name].title}: chosen" not in deck(start, *others)
