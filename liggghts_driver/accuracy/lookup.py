"""Where studies of accuracy are found: the user's own, then those that come with the package."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from liggghts_driver.accuracy.study import Study
from liggghts_driver.resources import cases_dir

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

_NAME = "accuracy.json"
#: Folder of all runs, in the working directory.
_RUNS = Path("runs")


@dataclass(frozen=True)
class Found:
    """A study, and what its file is called."""

    study: Study
    file: str


def find_study(problem: str) -> Found | None:
    """The study of a problem that knows it best: the user's own before others, the most packings.

    Parameters
    ----------
    problem
        Its identity, ``problem_sha256``.
    """
    for files in (_own(), _shipped()):
        found = [each for each in _read(files) if each.study.problem_sha256 == problem]
        if found:
            return max(found, key=lambda each: (each.study.replicates, each.study.duration_s))
    return None


def _own() -> Iterator[tuple[Path, str]]:
    for pattern in (_NAME, f"*/{_NAME}", f"*/*/{_NAME}"):
        yield from ((path, str(path)) for path in sorted(_RUNS.glob(pattern)))


def _shipped() -> Iterator[tuple[Path, str]]:
    for path in sorted((cases_dir() / "accuracy").glob("*.json")):
        yield path, f"cases/accuracy/{path.name}"


def _read(files: Iterable[tuple[Path, str]]) -> Iterator[Found]:
    """The studies among some files; what is broken, or something else, is none."""
    for path, name in files:
        try:
            yield Found(Study.model_validate_json(path.read_bytes()), name)
        except (OSError, ValueError):
            continue  # pydantic's errors are ValueErrors too
