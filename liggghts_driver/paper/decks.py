"""Identity of what the engine was given, to tell a stored result from what would be run today."""

from __future__ import annotations

import hashlib
import re
from typing import TYPE_CHECKING

from liggghts_driver.deck.build import CHECKPOINT_FILE, CONTROL_FILE, build_deck
from liggghts_driver.identity import scene_hash
from liggghts_driver.prepare import prepare

if TYPE_CHECKING:
    from collections.abc import Mapping

    from liggghts_driver.rundir import RunDirectory
    from liggghts_driver.scene.model import Scene

#: What an answer does not depend on: how a run is interrupted.
_LEFT_OUT = (CONTROL_FILE, CHECKPOINT_FILE)
_NUMBER = re.compile(r"-?\b\d+(?:\.\d+)?(?:e[-+]?\d+)?\b")


def files_sha256(files: Mapping[str, str]) -> str:
    """The SHA-256 of what the engine reads, comments left out and numbers to nine digits.

    What differs beyond nine digits is rounding, which may be another on another processor.
    """
    digest = hashlib.sha256()
    for name in sorted(set(files) - set(_LEFT_OUT)):
        digest.update(f"{name}\0".encode())
        for line in files[name].splitlines():
            command = line.partition("#")[0].rstrip()
            if command:
                digest.update((_NUMBER.sub(_nine_digits, command) + "\n").encode())
    return digest.hexdigest()


def _nine_digits(match: re.Match[str]) -> str:
    return f"{float(match[0]):.9g}"


def deck_sha256_of(scene: Scene, ranks: int = 1) -> str:
    """That of the deck which is generated today; the spheres are placed for it."""
    return files_sha256(build_deck(prepare(scene), scene_hash(scene), ranks).files)


def deck_sha256_in(run: RunDirectory) -> str:
    """That of the deck with which a run began."""
    begun = run.parts()[0].path
    paths = [*begun.glob("*.in"), *begun.glob("*.data"), *begun.glob("*.stl")]
    return files_sha256({path.name: path.read_text(encoding="utf-8") for path in paths})
