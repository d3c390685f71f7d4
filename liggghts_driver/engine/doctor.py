"""Look at what a run needs from the machine."""

from __future__ import annotations

import shutil
from dataclasses import dataclass

from liggghts_driver.engine.find import INSTALL, find_engine
from liggghts_driver.errors import EngineNotFoundError


@dataclass(frozen=True)
class Finding:
    """One program: found or not, and what to do. ``needed``: nothing runs without it."""

    name: str
    found: bool
    needed: bool
    detail: str


def examine() -> list[Finding]:
    """Everything that a run needs, and whether it is here."""
    return [_engine(), _program("stdbuf", needed=True), _program("mpirun", needed=False)]


def _engine() -> Finding:
    try:
        engine = find_engine()
    except EngineNotFoundError as error:
        return Finding("liggghts", found=False, needed=True, detail=str(error))
    return Finding("liggghts", found=True, needed=True, detail=f"{engine.binary}, {engine.version}")


def _program(name: str, *, needed: bool) -> Finding:
    path = shutil.which(name)
    detail = path or f"install it with: {INSTALL[name]}"
    return Finding(name, found=path is not None, needed=needed, detail=detail)
