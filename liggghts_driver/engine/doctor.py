"""Look at what a run needs from the machine."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from liggghts_driver.engine.find import INSTALL, find_engine, lone_environment
from liggghts_driver.errors import EngineNotFoundError

#: The least deck that makes the coupling on which the implicit drag stands.
_COUPLING_DECK = """\
units si
atom_style granular
atom_modify map array
boundary f f f
newton off
region domain block 0 1 0 1 0 1 units box
create_box 1 domain
fix coupling all couple/cfd every 0 mpi
fix drag all couple/cfd/force/implicit CrankNicolson 1.0
"""
_PROBE_TIMEOUT_S = 30.0


@dataclass(frozen=True)
class Finding:
    """One thing looked for: found or not, and what to do. ``needed``: nothing runs without it."""

    name: str
    found: bool
    needed: bool
    detail: str


def examine() -> list[Finding]:
    """Everything that a run needs, and whether it is here."""
    programs = [_program(name, needed=True) for name in ("stdbuf", "env", "setpriv")]
    programs.append(_program("mpirun", needed=False))
    try:
        engine = find_engine()
    except EngineNotFoundError as error:
        return [Finding("liggghts", found=False, needed=True, detail=str(error)), *programs]
    detail = f"{engine.binary}, {engine.version}"
    found = Finding("liggghts", found=True, needed=True, detail=detail)
    return [found, *programs, _coupling(engine.binary)]


def _program(name: str, *, needed: bool) -> Finding:
    path = shutil.which(name)
    detail = path or f"install it with: {INSTALL[name]}"
    return Finding(name, found=path is not None, needed=needed, detail=detail)


def _coupling(binary: str) -> Finding:
    """Whether the binary was built with the coupling that drag uses unless told not to."""
    with tempfile.TemporaryDirectory() as folder:
        deck = Path(folder) / "probe.in"
        deck.write_text(_COUPLING_DECK, encoding="utf-8")
        command = [binary, "-in", str(deck), "-log", "none"]
        try:
            with lone_environment() as environment:
                done = subprocess.run(
                    command,
                    cwd=folder,
                    env=environment,
                    stdin=subprocess.DEVNULL,
                    capture_output=True,
                    timeout=_PROBE_TIMEOUT_S,
                    check=False,
                )
            found = done.returncode == 0
        except subprocess.TimeoutExpired:
            found = False
    lacking = "not built into this engine; use --set drag.carrier=addforce"
    detail = "built in" if found else lacking
    return Finding("coupling for drag", found=found, needed=False, detail=detail)
