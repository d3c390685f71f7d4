"""A deck taken apart: its commands, what they define, and its formulas evaluated in Python."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver.deck.build import Deck, build_deck

if TYPE_CHECKING:
    from collections.abc import Iterator

    from liggghts_driver.case import Case

#: What an atom-style formula of the engine may name besides numbers and other variables.
ATOM_WORDS = {"id", "mass", "type", "x", "y", "z", "vx", "vy", "vz", "fx", "fy", "fz", "r"}
FUNCTIONS = {"sqrt": math.sqrt}
_REFERENCE = re.compile(r"\b([vcf])_(\w+)")


def deck_of(case: Case, ranks: int = 1) -> Deck:
    """The deck of a case, with zeros for the hash of its scene."""
    return build_deck(case, "0" * 64, ranks)


def commands(deck: str) -> list[list[str]]:
    """The commands of a deck as words: comments gone, continued lines joined, quotes kept whole."""
    joined = deck.replace("&\n", " ")
    words = (re.findall(r'"[^"]*"|[^\s#]+|#.*', line) for line in joined.splitlines())
    plain = [[word for word in line if not word.startswith("#")] for line in words]
    return [line for line in plain if line]


def variables(deck: str) -> dict[str, str]:
    """Formulas by the names of their variables."""
    return {words[1]: words[3].strip('"') for words in commands(deck) if words[0] == "variable"}


def ids(deck: str, command: str) -> list[str]:
    """What the commands of one kind define, in the deck's order."""
    return [words[1] for words in commands(deck) if words[0] == command]


@dataclass(frozen=True)
class Use:
    """A name that a command uses: v for a variable, c a compute, f a fix, region, group."""

    kind: str
    name: str
    command: tuple[str, ...]


def undefined_names(deck: str) -> Iterator[Use]:
    """Every name that a command uses before, or without, a command that defines it."""
    known = {("group", "all")}
    for words in commands(deck):
        # The engine looks a variable of a formula up when it needs it: inside a formula the order
        # does not matter, so only what the end of the deck does not know either is undefined.
        late = words[0] == "variable"
        for use in _uses(words):
            if (use.kind, use.name) not in (_all_defined(deck) if late else known):
                yield use
        known |= _defined_by(words)


def _all_defined(deck: str) -> set[tuple[str, str]]:
    return set().union(*(_defined_by(words) for words in commands(deck)))


def _defined_by(words: list[str]) -> set[tuple[str, str]]:
    kinds = {"variable": "v", "compute": "c", "fix": "f", "region": "region", "group": "group"}
    found = {(kinds[words[0]], words[1])} if words[0] in kinds else set()
    if "couple/cfd/force" in words:
        found |= {("f", "dragforce")}
    if "couple/cfd/force/implicit" in words:
        found |= {("f", name) for name in ("Ksl", "uf", "dragforce")}
    return found


def _uses(words: list[str]) -> Iterator[Use]:
    for kind, name in _REFERENCE.findall(" ".join(words[1:])):
        yield Use(kind, name, tuple(words))
    if words[0] in {"set", "run"}:  # "run" has commands in quotes
        for name in re.findall(r"property/atom (\w+)", " ".join(words)):
            yield Use("f", name, tuple(words))
    if words[0] in {"fix", "compute", "dump"}:
        yield Use("group", words[2], tuple(words))
    for kind in ("region", "group"):
        if words[0] not in {kind, "group", "region", "variable"} and kind in words[1:]:
            yield Use(kind, words[words.index(kind, 1) + 1], tuple(words))


def evaluate(formula: str, known: dict[str, str], atom: dict[str, float]) -> float:
    """A formula of the engine for one atom.

    The engine's grammar is Python's but for ``^``, for comparisons that give 1 or 0, and for a
    unary minus that binds more tightly than ``^`` (no formula here may depend on that).
    ``atom`` holds the engine's own words and the values of fixes, ``{"vx": 1.0, "f_uf[1]": 0.1}``.
    """
    assert not re.search(r"(^|[-+*/(])-[^-+*/()]*\^", formula), "-a^b means (-a)^b to the engine"
    text = formula.replace("^", "**")
    names: dict[str, object] = dict(FUNCTIONS)
    for number, (word, value) in enumerate(atom.items()):
        if not word.isidentifier():
            text = text.replace(word, f"given{number}")
            word = f"given{number}"
        names[word] = value
    for name in {name for kind, name in _REFERENCE.findall(text) if kind == "v"}:
        if f"v_{name}" not in names:
            names[f"v_{name}"] = evaluate(known[name], known, atom)
    words = set(re.findall(r"[A-Za-z_]\w*", re.sub(r"\d\.?\d*e[-+]?\d+", "", text)))
    assert words <= set(names) | ATOM_WORDS, f"{formula}: the engine has no {words - set(names)}"
    return float(eval(text, {"__builtins__": {}}, names))
