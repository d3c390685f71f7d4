"""A deck taken apart: its commands, what they define, and its formulas evaluated in Python."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from liggghts_driver.case import Checkpoint
from liggghts_driver.deck.build import Deck, build_deck

if TYPE_CHECKING:
    from collections.abc import Iterator

    from liggghts_driver.case import Case

#: What an atom-style formula of the engine may name besides numbers and other variables.
ATOM_WORDS = {"id", "mass", "type", "r"}
ATOM_WORDS |= {word + axis for word in ("", "v", "f", "omega", "tq") for axis in "xyz"}
FUNCTIONS = {"sqrt": math.sqrt, "cos": math.cos}
_REFERENCE = re.compile(r"\b([vcf])_(\w+)")
#: The scripts of a deck; the engine comes from one to the next when a checkpoint is asked for.
SCRIPTS = ("deck.in", "pieces.in", "checkpoint.in")


def deck_of(case: Case, ranks: int = 1) -> Deck:
    """The deck of a case, with zeros for the hash of its scene."""
    return build_deck(case, "0" * 64, ranks)


def whole(deck: Deck) -> str:
    """All scripts of a deck, one after the other."""
    return "".join(deck.files[name] for name in SCRIPTS)


def piece_steps(deck: Deck) -> int:
    """How many steps a piece of the run has."""
    (run,) = [words for words in commands(deck.files["pieces.in"]) if words[0] == "run"]
    return int(run[1])


def taken_up(case: Case, number: int = 1, velocity: float = 0.02) -> Case:
    """The case from a checkpoint on, at the end of its first, second ... piece."""
    step = number * piece_steps(deck_of(replace(case, checkpoint=None)))
    restart = f"segments/{number}/restart/step.{step}.restart"
    return replace(case, checkpoint=Checkpoint(number, step, restart, velocity))


def commands(deck: str) -> list[list[str]]:
    """The commands of a deck as words: comments gone, continued lines joined, quotes kept whole."""
    joined = deck.replace("&\n", " ")
    words = (re.findall(r'"[^"]*"|[^\s#]+|#.*', line) for line in joined.splitlines())
    plain = [[word for word in line if not word.startswith("#")] for line in words]
    return [line for line in plain if line]


def followed(deck: Deck, asked: int | None = None) -> list[list[str]]:
    """The commands as the engine carries them out, pieces again and again.

    ``asked`` is the piece, counted from 1, while which the driver asks for a checkpoint.
    """
    return list(_Reader(deck.files, asked).read())


@dataclass
class _Reader:
    """Goes through the scripts of a deck as the engine does: its loop and jumps."""

    files: dict[str, str]
    asked: int | None
    piece: int = 1
    pieces: int = 0
    jumps: int = 0
    skips_jump: bool = False

    def read(self) -> Iterator[list[str]]:
        ahead = commands(self.files["deck.in"])
        while ahead:
            words = ahead.pop(0)
            yield words
            if words[0] == "quit":
                return
            ahead = self._after(words, ahead)

    def _after(self, words: list[str], ahead: list[list[str]]) -> list[list[str]]:
        match words:
            case ["variable", "piece", "loop", pieces]:
                self.pieces = int(pieces)
                assert self.pieces > 0, "the engine refuses a loop of no turns"
            case ["next", "piece"]:
                self.piece += 1
                self.skips_jump = self.piece > self.pieces
            case ["jump", name] if not self.skips_jump:
                self.jumps += 1
                assert self.jumps <= 2 * self.pieces, "the loop has no end"
                return commands(self._file(name))
            case ["jump", _]:
                self.skips_jump = False
        return ahead

    def _file(self, name: str) -> str:
        asks = self.asked is not None and self.piece > self.asked
        return self.files["checkpoint.in" if name == "control.in" and asks else name]


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
    command, text = tuple(words), " ".join(words)
    used = _REFERENCE.findall(" ".join(words[1:]))
    if words[0] == "set":
        used += [("f", name) for name in re.findall(r"property/atom (\w+)", text)]
    if words[0] == "next":
        used.append(("v", words[1]))
    place = {"fix": 2, "compute": 2, "dump": 2, "write_dump": 1}.get(words[0])
    if place is not None:
        used.append(("group", words[place]))
    for kind in ("region", "group"):
        if words[0] not in {kind, "group", "region", "variable"} and kind in words[1:]:
            used.append((kind, words[words.index(kind, 1) + 1]))
    for kind, name in used:
        yield Use(kind, name, command)


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
