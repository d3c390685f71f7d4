"""What to tell someone whose run failed: the engine's own words, the deck line, the last lines."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from liggghts_driver.rundir import RunDirectory

_LAST_LINES = 8


def failure_message(run: RunDirectory, faults: list[str]) -> str:
    """One message about a failed run; the folder stays as it is."""
    text = _read(run.stdout)
    errors = [line.strip() for line in text.splitlines() if line.startswith("ERROR")]
    deck = culprit(_read(run.deck), text) if errors else None
    parts = [f"the run failed: {'; '.join(faults)}"]
    parts += [f"  the engine says: {line}" for line in errors[:3]]
    if deck is not None:
        parts.append(f"  at {run.deck.name}, line {deck[0]}: {deck[1]}")
    parts += ["  its last lines:", *(f"    | {line}" for line in _tail(text))]
    parts.append(f"  everything is kept in {run.path} ({run.stdout.name}, {run.log.name})")
    return "\n".join(parts)


def culprit(deck: str, output: str) -> tuple[int, str] | None:
    """Number and text of the deck line that the engine read last.

    The engine names no line, but it echoes each command before it carries it out: the deck is
    followed through the output as far as it goes.
    """
    echoed = iter(_normal(line) for line in output.splitlines())
    last = None
    for number, line in enumerate(deck.splitlines(), start=1):
        wanted = _normal(line)
        if not wanted or wanted.startswith("#"):
            continue
        if not any(seen == wanted for seen in echoed):
            break
        last = (number, line.strip())
    return last


def _normal(line: str) -> str:
    return re.sub(r"\s+", " ", line).strip()


def _tail(text: str) -> list[str]:
    return [line for line in text.splitlines() if line.strip()][-_LAST_LINES:]


def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace") if path.exists() else ""
