"""The run directory: one class owns every file name in it, and its state on disk."""

from __future__ import annotations

import fnmatch
import itertools
import json
import shutil
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from liggghts_driver.errors import RunFolderError
from liggghts_driver.identity import scene_hash
from liggghts_driver.outputs import write_text
from liggghts_driver.scene.read import make_scene

if TYPE_CHECKING:
    from pathlib import Path

    from liggghts_driver.scene.model import Scene


_OF_A_CLAIM = {"claim.json", "claim.lock"}
#: What a run writes besides its scene; the last is the engine's own, when it is told to end.
_OF_A_RUN = (
    "deck.in", "pieces.in", "control.in", "checkpoint.in", "particles.data", "piston.stl",
    "log.liggghts", "stdout.log", "run.json", "series.txt", "series.csv", "results.json",
    "report.html", "figures", "dumps", "restart", "restart_forced_*",
)  # fmt: skip


@dataclass(frozen=True)
class RunDirectory:
    """Names of everything that a run reads and writes."""

    path: Path

    @property
    def scene(self) -> Path:
        """The scene, resolved: every default filled in."""
        return self.path / "scene.json"

    @property
    def deck(self) -> Path:
        """The engine's input."""
        return self.path / "deck.in"

    @property
    def pieces(self) -> Path:
        """The part of the deck that the engine goes through again and again."""
        return self.path / "pieces.in"

    @property
    def control(self) -> Path:
        """What the engine carries out after each piece: nothing, or a checkpoint."""
        return self.path / "control.in"

    @property
    def checkpoint_commands(self) -> Path:
        """The engine's commands for a checkpoint."""
        return self.path / "checkpoint.in"

    @property
    def checkpoint(self) -> Path:
        """Of a segment: the state of the engine at its end, besides the restart file."""
        return self.path / "checkpoint.json"

    @property
    def restarts(self) -> Path:
        """The engine's restart files."""
        return self.path / "restart"

    @property
    def claim(self) -> Path:
        """Who works here."""
        return self.path / "claim.json"

    @property
    def log(self) -> Path:
        """What the engine logs."""
        return self.path / "log.liggghts"

    @property
    def stdout(self) -> Path:
        """What the engine prints."""
        return self.path / "stdout.log"

    @property
    def state(self) -> Path:
        """How the run went: running, complete, failed or interrupted."""
        return self.path / "run.json"

    @property
    def series(self) -> Path:
        """The time series as a table."""
        return self.path / "series.csv"

    @property
    def engine_series(self) -> Path:
        """The time series as the engine writes it."""
        return self.path / "series.txt"

    @property
    def results(self) -> Path:
        """The answer."""
        return self.path / "results.json"

    @property
    def report(self) -> Path:
        """The answer as a page."""
        return self.path / "report.html"

    @property
    def figures(self) -> Path:
        """Figures of the report."""
        return self.path / "figures"

    @property
    def dumps(self) -> Path:
        """Frames and snapshots written by the engine."""
        return self.path / "dumps"

    def frame_files(self) -> list[Path]:
        """Frames of the particles, in the order of time."""
        return _dumped(self.parts(), "particles.*.bin")

    def kept_frame_files(self) -> list[Path]:
        """Those up to the last checkpoint."""
        return _dumped(self.segments(), "particles.*.bin")

    def snapshot_files(self) -> list[Path]:
        """Pictures rendered by the engine, in the order of time."""
        return _dumped(self.parts(), "snapshot.*.ppm")

    @staticmethod
    def step_of(dumped: Path) -> int:
        """The step of a frame or of a picture, which is in its name."""
        return int(dumped.name.split(".")[1])

    def segments(self) -> list[RunDirectory]:
        """What a run left at each of its checkpoints, in the order of time."""
        named = (self.path / "segments").glob("[0-9]*")
        found = sorted((p for p in named if p.name.isdecimal()), key=lambda path: int(path.name))
        return [RunDirectory(path) for path in found]

    def parts(self) -> list[RunDirectory]:
        """All that together is the run: its segments, and what came after the last of them."""
        return [*self.segments(), self]

    def seal_segment(self, facts: dict[str, Any]) -> None:
        """Make a segment of all that belongs to a checkpoint: it is there whole, or not at all."""
        earlier = self.segments()
        number = len(earlier) + 1
        unfinished = self.path / "segments" / f".{number}"
        self._move_into(unfinished, keep=("run.json",))
        write_text(RunDirectory(unfinished).checkpoint, json.dumps(facts, indent=2) + "\n")
        unfinished.rename(unfinished.with_name(str(number)))
        for segment in earlier:
            segment.drop_restarts()

    def gather_frames(self) -> None:
        """Put frames and pictures of all segments of a finished run where others have them."""
        for path in (self.path / "segments").glob("*/dumps/*"):
            if not (self.dumps / path.name).exists():
                path.rename(self.dumps / path.name)

    def drop_restarts(self) -> None:
        """Delete the restart files of a run that needs none any more."""
        for part in self.parts():
            shutil.rmtree(part.restarts, ignore_errors=True)

    def checkpoints(self) -> list[dict[str, Any]]:
        """The state at each checkpoint, in the order of time.

        Raises
        ------
        RunFolderError
            If one cannot be read.
        """
        return [segment._read_checkpoint() for segment in self.segments()]

    def _read_checkpoint(self) -> dict[str, Any]:
        try:
            data = json.loads(self.checkpoint.read_text(encoding="utf-8"))
            return {**data, "step": int(data["step"]), "restart": str(data["restart"])}
        except (OSError, ValueError, LookupError, TypeError) as error:
            raise RunFolderError(f"{self.checkpoint}: no checkpoint ({error})") from None

    def checkpoint_fault(self) -> str | None:
        """What keeps a run from going on from its last checkpoint; None if nothing does."""
        try:
            last = self.checkpoints()[-1]
        except RunFolderError as error:
            return str(error)
        restart = self.segments()[-1].restarts / last["restart"]
        size = restart.stat().st_size if restart.is_file() else None
        if size is None:
            return f"{restart} is not there"
        # Older versions did not tell how large it was.
        whole = last.get("restart_bytes", size)
        return None if size == whole else f"{restart} has {size} of its {whole} bytes"

    def read_state(self) -> dict[str, Any]:
        """What is known of the run; ``{"state": "absent"}`` when nothing is."""
        try:
            loaded = json.loads(self.state.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return {"state": "absent"}
        except ValueError:
            return {"state": "unreadable"}
        return loaded if isinstance(loaded, dict) and "state" in loaded else {"state": "unreadable"}

    def write_state(self, **facts: object) -> None:
        """Record how the run goes."""
        write_text(self.state, json.dumps(facts, indent=2) + "\n")

    def read_scene(self) -> Scene:
        """The scene that this directory holds.

        Raises
        ------
        RunFolderError
            If it holds none that can be read.
        """
        try:
            data = json.loads(self.scene.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise RunFolderError(f"{self.path}: not a run directory ({error})") from None
        return make_scene(data, str(self.scene))

    def write_scene(self, scene: Scene) -> None:
        """Keep the scene, every default filled in."""
        data = scene.model_dump(mode="json", exclude_none=True)
        write_text(self.scene, json.dumps(data, indent=2) + "\n")

    def claim_for(self, scene: Scene) -> None:
        """Make the folder ready for a scene; refuse one that holds anything else.

        Raises
        ------
        RunFolderError
            If the folder cannot be made, holds another scene, or files that no run wrote.
        """
        if self.make_or_find_empty():
            return
        if not self.scene.exists():
            raise RunFolderError(
                f"{self.path}: holds files but no run; choose another folder with --out"
            )
        held = self.read_scene()
        if scene_hash(held) != scene_hash(scene):
            raise RunFolderError(
                f"{self.path}: holds a run of another scene; choose another folder with --out"
            )
        if held.accuracy != scene.accuracy:
            self.write_scene(scene)  # the same run, asked for in other words

    def make_or_find_empty(self) -> bool:
        """Make the folder if it is not there; whether there is nothing in it.

        Raises
        ------
        RunFolderError
            If it can be no folder.
        """
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            # A claim without a run: its maker died, or is about to write one.
            found = {item for item in self.path.iterdir() if item.name not in _OF_A_CLAIM}
            return not found or (found == {self.dumps} and not any(self.dumps.iterdir()))
        except OSError as error:
            raise RunFolderError(
                f"{self.path}: cannot be a run directory ({error.strerror}); choose another with "
                "--out"
            ) from None

    def set_aside(self, *, segments: bool) -> Path | None:
        """Move what an unfinished run left into ``attempt-N``, so that nothing is lost.

        Files that no run wrote stay where they are. So does the scene: the folder stays claimed.
        ``segments`` tells whether those go too: they do when the run starts anew.
        """
        half_made = [*(self.path / "segments").glob(".[0-9]*")]
        if self.segments() and not (segments or half_made or self.deck.exists()):
            return None  # it ended at a checkpoint, and nothing came after that
        folders = (self.path / f"attempt-{number}" for number in itertools.count(1))
        attempt = next(folder for folder in folders if not folder.exists())
        self._move_into(attempt)
        whole = [self.path / "segments"] if segments else []
        # A segment with a dot was being made when its maker died.
        for item in whole or half_made:
            if item.exists():
                attempt.mkdir(exist_ok=True)
                item.rename(attempt / item.name)
        if not attempt.exists():
            return None
        if self.scene.exists():
            shutil.copy2(self.scene, attempt / self.scene.name)
        return attempt

    def _move_into(self, folder: Path, keep: tuple[str, ...] = ()) -> None:
        """Move what a run wrote, but for what is kept, into a folder that is made if needed."""
        items = [i for i in self.path.iterdir() if _is_of_a_run(i.name) and i.name not in keep]
        if items:
            folder.mkdir(parents=True, exist_ok=True)
        for item in items:
            item.rename(folder / item.name)


def _dumped(parts: list[RunDirectory], pattern: str) -> list[Path]:
    """What the parts of a run dumped; one begins with the instant at which the last one ended."""
    found = {path.name: path for part in parts for path in part.dumps.glob(pattern)}
    return [found[name] for name in sorted(found)]


def _is_of_a_run(name: str) -> bool:
    """Whether a run writes files or folders of that name."""
    return any(fnmatch.fnmatchcase(name, pattern) for pattern in _OF_A_RUN)
