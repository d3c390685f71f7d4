"""Where the templates and the shipped cases are: in a checkout or in an installed wheel alike."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def templates_dir() -> Path:
    """The folder of the deck and report templates."""
    return _folder("templates")


def cases_dir() -> Path:
    """The folder of the shipped scenes."""
    return _folder("cases")


def _folder(name: str) -> Path:
    # A wheel carries the folders inside the package; a checkout has them beside it.
    candidates = (_PACKAGE / name, _PACKAGE.parent / name)
    return next(folder for folder in candidates if folder.is_dir())
