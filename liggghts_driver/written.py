"""What a run directory is given: the deck and all that the engine reads."""

from __future__ import annotations

from typing import TYPE_CHECKING

from liggghts_driver.deck.build import CONTROL_FILE, build_deck
from liggghts_driver.errors import RunFolderError
from liggghts_driver.outputs import write_text

if TYPE_CHECKING:
    from pathlib import Path

    from liggghts_driver.case import Case
    from liggghts_driver.deck.build import Deck
    from liggghts_driver.rundir import RunDirectory


def write_deck(case: Case, deck: Deck, directory: RunDirectory) -> None:
    """Write everything that the engine reads, and the scene it came from."""
    directory.write_scene(case.identity)
    directory.dumps.mkdir(parents=True, exist_ok=True)
    for name, text in deck.files.items():
        write_text(directory.path / name, text)


def require_same_deck(case: Case, directory: RunDirectory, identity: str) -> None:
    """Refuse to pass off an older version's run as what this version would compute.

    Raises
    ------
    RunFolderError
        If a file that the engine read is not what this version would write.
    """
    other = other_than_written(case, directory, identity)
    if other is not None:
        raise RunFolderError(
            f"{directory.path}: holds a finished run of this scene, but its {other} is not what "
            "this version of the software would write; choose another folder with --out"
        )


def other_than_written(case: Case, directory: RunDirectory, identity: str) -> str | None:
    """The first file that a run began with and this version would write otherwise; None if none."""
    begun = directory.parts()[0]
    # A run may go on with another number of processes than it began with.
    ranks = [*directory.checkpoints(), directory.read_state()][0].get("ranks", 1)
    for name, text in build_deck(case, identity, ranks).files.items():
        path = begun.path / name
        wanted = name == CONTROL_FILE or (
            path.exists() and _commands(_text_of(path)) == _commands(text)
        )
        if not wanted:
            return name
    return None


def _text_of(path: Path) -> str:
    """A text as it is; what is none differs from any that is written."""
    return path.read_text(encoding="utf-8", errors="replace")


def _commands(deck: str) -> list[str]:
    """A deck without its comments, in which a title may have changed."""
    lines = (line.partition("#")[0].rstrip() for line in deck.splitlines())
    return [line for line in lines if line]
