"""How files are written: whole or not at all, and none that another wrote is overwritten."""

from __future__ import annotations

import contextlib
import json
import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from liggghts_driver.errors import RunFolderError

if TYPE_CHECKING:
    from collections.abc import Iterable


def write_text(path: Path, text: str) -> None:
    """Write a text so that it is either whole or not there."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file so that it is either whole or not there."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        Path(name).chmod(0o644)
        Path(name).replace(path)
    except BaseException as error:
        with contextlib.suppress(FileNotFoundError):
            Path(name).unlink()
        if isinstance(error, OSError) and error.filename is None:
            error.filename = str(path)  # a full disk names no file
        raise


def require_free_names(
    folder: Path, names: Iterable[str], *, ours: bool = False, option: str = "--out"
) -> None:
    """Refuse a folder in which files would be overwritten, or that can be none.

    Parameters
    ----------
    folder
        Where files are about to be written; it need not exist.
    names
        Of these files.
    ours
        Whether what is there already is an earlier version of the same.
    option
        With which another folder is chosen.

    Raises
    ------
    RunFolderError
        With what stands in the way.
    """
    if folder.exists() and not folder.is_dir():
        raise RunFolderError(f"{folder}: is a file; choose a folder with {option}")
    theirs = [] if ours else [name for name in names if (folder / name).exists()]
    if theirs:
        raise RunFolderError(
            f"{folder}: holds {', '.join(theirs)} that would be overwritten and is not of this "
            f"very study; choose another folder with {option}"
        )


def require_study_folder(folder: Path, study: str, scene_sha256: str | None = None) -> None:
    """Refuse a folder for a study that holds the files of another, or anyone else's.

    Parameters
    ----------
    folder
        The study's; it need not exist.
    study
        Its name, which its files have too.
    scene_sha256
        Hash of the scene that is studied; None where there is none.

    Raises
    ------
    RunFolderError
        With what stands in the way.
    """
    names = [f"{study}.{ending}" for ending in ("json", "csv", "png")]
    require_free_names(folder, names, ours=_is_of(folder / names[0], study, scene_sha256))


def _is_of(path: Path, study: str, scene_sha256: str | None) -> bool:
    """Whether a file holds the results of a study of a scene."""
    try:
        held = json.loads(path.read_text(encoding="utf-8"))
        same_scene = scene_sha256 in (None, held["provenance"]["scene_sha256"])
        return bool(held["study"] == study and same_scene)
    except (OSError, ValueError, LookupError, TypeError):
        return False
