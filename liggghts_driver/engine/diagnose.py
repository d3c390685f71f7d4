"""What to tell someone whose run failed: the engine's own words, the deck line, the last lines."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from liggghts_driver.rundir import RunDirectory

_LAST_LINES = 8
_WIDEST_LINE = 200
_HEAD_BYTES = 4_000_000
_TAIL_BYTES = 1_000_000
#: "Lost atoms: original 40 current 39", and what single processes say of it. Other things may be
#: missing too, an argument of a command say.
_LOST = re.compile(r"\blost atoms?\b|\b(atoms?|mesh elements)\b.*\b(lost|missing)\b", re.IGNORECASE)


def failure_message(run: RunDirectory, faults: list[str], notes: Sequence[str] = ()) -> str:
    """One message about a failed run, with what else is known of it; the folder stays as it is."""
    text = _read(run.stdout)
    errors = _errors(text)
    deck = _culprit(run, text) if errors else None
    parts = [f"the run failed: {'; '.join(faults)}", *(f"  {note}" for note in notes)]
    parts += [f"  the engine says: {line}" for line in errors[:3]]
    if deck is not None:
        parts.append(f"  at {deck[0]}, line {deck[1]}: {deck[2]}")
    parts += ["  its last lines:", *(f"    | {line}" for line in _tail(text))]
    parts.append(f"  everything is kept in {run.path} ({run.stdout.name}, {run.log.name})")
    return "\n".join(parts)


def engine_errors(run: RunDirectory) -> list[str]:
    """What the engine printed as errors; those of a single process are in no log."""
    return _errors(_read(run.stdout))


def lost_spheres(run: RunDirectory) -> bool:
    """Whether the engine ended because spheres had left its box."""
    return any(_LOST.search(line) for line in engine_errors(run))


def _errors(text: str) -> list[str]:
    return [line.strip() for line in text.splitlines() if line.startswith("ERROR")]


def _culprit(run: RunDirectory, output: str) -> tuple[str, int, str] | None:
    """File, number and text of the line that the engine read last."""
    found = culprit(_read(run.deck), output)
    if found is None or not found[1].startswith("jump"):
        return None if found is None else (run.deck.name, *found)
    # It went through the pieces again and again: the last of their commands that it echoed.
    echoed = [_normal(line) for line in output.splitlines()]
    numbered = {_normal(line): (number, line) for number, line in _commands(_read(run.pieces))}
    last = next((line for line in reversed(echoed) if line in numbered), None)
    return (run.deck.name, *found) if last is None else (run.pieces.name, *numbered[last])


def culprit(deck: str, output: str) -> tuple[int, str] | None:
    """Number and text of the deck line that the engine read last.

    The engine names no line, but it echoes each command before it carries it out: the deck is
    followed through the output as far as it goes.
    """
    echoed = iter(_normal(line) for line in output.splitlines())
    last = None
    for number, line in _commands(deck):
        if not any(seen == _normal(line) for seen in echoed):
            break
        last = (number, line.strip())
    return last


def _commands(deck: str) -> Iterator[tuple[int, str]]:
    """Each command with the number of its first line; ``&`` joins it with the next line."""
    start, command = 0, ""
    for number, line in enumerate(deck.splitlines(), start=1):
        start = start if command else number
        joined = command + line
        if joined.rstrip().endswith("&"):
            command = joined.rstrip().removesuffix("&")
            continue
        command = ""
        if _normal(joined) and not joined.lstrip().startswith("#"):
            yield start, joined


def _normal(line: str) -> str:
    return re.sub(r"\s+", " ", line).strip()


def _tail(text: str) -> list[str]:
    lines = [line for line in text.splitlines() if line.strip()]
    return [line[:_WIDEST_LINE] for line in lines[-_LAST_LINES:]]


def _read(path: Path) -> str:
    """The beginning and the end of a file: what a program gone wild prints between is not kept."""
    if not path.exists():
        return ""
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
        file.seek(max(file.tell(), path.stat().st_size - _TAIL_BYTES))
        return (head + file.read()).decode("utf-8", errors="replace")
