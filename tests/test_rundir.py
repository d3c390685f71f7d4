"""The run directory: its names, its state, and what it refuses to touch."""

from __future__ import annotations

import json

import pytest
from small_scenes import COLLISION, INFILTRATION, scene_of

from liggghts_driver import identity
from liggghts_driver.errors import RunFolderError, SceneError
from liggghts_driver.identity import scene_hash, templates_hash
from liggghts_driver.outputs import write_text
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.scene.canonical import canonical_json


@pytest.fixture
def run(tmp_path):
    return RunDirectory(tmp_path / "run")


@pytest.fixture
def filled(run):
    """A directory that holds a scene and some files of its run."""
    run.write_scene(scene_of(COLLISION))
    run.write_state(state="running")
    run.dumps.mkdir()
    (run.dumps / "particles.0000000000.bin").write_bytes(b"frame")
    run.deck.write_text("units si\n")
    return run


class TestHashes:
    def test_title_and_spelling_do_not_matter(self):
        one = scene_hash(scene_of(COLLISION))
        assert one == scene_hash(scene_of(COLLISION, {"title": "named"}))
        assert one == scene_hash(scene_of(COLLISION, {"particles.density": 7000}))
        assert one == scene_hash(scene_of(COLLISION, {"contact.friction": 0.0}))
        assert len(one) == 64

    @pytest.mark.parametrize(
        "changes", [{"seed": 2}, {"time.duration": 0.2}, {"output.frames": 6}], ids=str
    )
    def test_all_else_does(self, changes):
        assert scene_hash(scene_of(COLLISION)) != scene_hash(scene_of(COLLISION, changes))

    def test_canonical_json_is_one_text_for_equal_data(self):
        assert canonical_json({"b": [1, 2.5], "a": None}) == '{"a":null,"b":[1,2.5]}'
        with pytest.raises(ValueError, match="not JSON compliant"):
            canonical_json({"a": float("nan")})

    def test_templates_of_decks(self, tmp_path, monkeypatch):
        assert templates_hash() == templates_hash()
        effects = tmp_path / "effects"
        effects.mkdir()
        (tmp_path / "deck.in.j2").write_text("deck")
        (effects / "one.j2").write_text("text")
        monkeypatch.setattr(identity, "templates_dir", lambda: tmp_path)
        seen = [templates_hash()]
        (tmp_path / "deck.in.j2").write_text("another deck")
        seen.append(templates_hash())
        (effects / "one.j2").write_text("another text")
        seen.append(templates_hash())
        (effects / "one.j2").rename(effects / "two.j2")
        seen.append(templates_hash())
        assert len(set(seen)) == 4
        (tmp_path / "report.html.j2").write_text("a report changes no run")
        assert templates_hash() == seen[-1]


class TestWriteText:
    def test_new_and_over_an_old_file(self, tmp_path):
        path = tmp_path / "new" / "file.txt"
        write_text(path, "one μ\n")
        write_text(path, "two\n")
        assert path.read_text() == "two\n"
        assert [item.name for item in path.parent.iterdir()] == ["file.txt"]
        assert path.stat().st_mode & 0o777 == 0o644

    def test_a_failure_leaves_the_old_file_and_nothing_else(self, tmp_path):
        path = tmp_path / "file.txt"
        write_text(path, "old")
        with pytest.raises(UnicodeEncodeError):
            write_text(path, "\ud800")
        assert path.read_text() == "old"
        assert [item.name for item in tmp_path.iterdir()] == ["file.txt"]


class TestState:
    def test_round_trip(self, run):
        assert run.read_state() == {"state": "absent"}
        run.write_state(state="complete", ranks=2, parts={"a": 1.5})
        assert run.read_state() == {"state": "complete", "ranks": 2, "parts": {"a": 1.5}}

    @pytest.mark.parametrize(
        "content",
        [
            b"",
            b"{",
            b"[]",
            b"3",
            b"\xff\xfe",
            b"null",
            pytest.param(b"{}"),
        ],
    )
    def test_garbage_is_unreadable_not_an_error(self, run, content):
        run.path.mkdir()
        run.state.write_bytes(content)
        assert run.read_state()["state"] == "unreadable"


class TestScene:
    def test_every_default_is_written(self, run):
        run.write_scene(scene_of(INFILTRATION))
        data = json.loads(run.scene.read_text())
        assert data["contact"]["friction"] == 0.0
        assert data["drag"]["scheme"] == "auto"
        assert data["drag"]["carrier"] == "coupling"
        assert "box" not in data  # what is absent stays absent

    def test_none(self, run):
        with pytest.raises(RunFolderError, match="not a run directory"):
            run.read_scene()

    def test_garbage(self, run):
        run.path.mkdir()
        run.scene.write_text("{")
        with pytest.raises(RunFolderError, match="not a run directory"):
            run.read_scene()

    def test_a_scene_that_is_no_scene_any_more(self, run):
        run.path.mkdir()
        run.scene.write_text("{}")
        with pytest.raises((RunFolderError, SceneError), match=r"scene\.json"):
            run.read_scene()


class TestClaim:
    def test_an_absent_folder_is_made(self, tmp_path):
        run = RunDirectory(tmp_path / "a" / "b")
        run.claim_for(scene_of(COLLISION))
        assert run.path.is_dir()

    def test_an_empty_folder_is_taken(self, run):
        run.path.mkdir()
        run.claim_for(scene_of(COLLISION))

    def test_the_same_scene_is_taken(self, filled):
        filled.claim_for(scene_of(COLLISION, {"title": "other words"}))

    def test_another_scene_is_refused(self, filled):
        with pytest.raises(RunFolderError, match=r"another scene; .*--out"):
            filled.claim_for(scene_of(COLLISION, {"seed": 2}))

    @pytest.mark.parametrize("name", ["thesis.tex", ".hidden", "deck.in"])
    def test_foreign_files_are_refused_and_kept(self, run, name):
        run.path.mkdir()
        (run.path / name).write_text("precious")
        with pytest.raises(RunFolderError, match=r"no run; .*--out"):
            run.claim_for(scene_of(COLLISION))
        assert (run.path / name).read_text() == "precious"

    def test_foreign_files_beside_a_run_stay_where_they_are(self, filled):
        (filled.path / "notes.txt").write_text("precious")
        filled.set_aside(segments=True)
        assert (filled.path / "notes.txt").read_text() == "precious"

    @pytest.mark.parametrize(
        "make",
        [
            lambda path: path.write_text("a file"),
            lambda path: path.symlink_to("/proc/no/such/place"),
        ],
        ids=["file", "dangling link"],
    )
    def test_a_path_that_can_be_no_folder_is_refused(self, run, make):
        make(run.path)
        with pytest.raises(RunFolderError):
            run.claim_for(scene_of(COLLISION))

    def test_a_path_below_a_file_is_refused(self, tmp_path):
        (tmp_path / "file").write_text("")
        with pytest.raises(RunFolderError):
            RunDirectory(tmp_path / "file" / "run").claim_for(scene_of(COLLISION))


class TestSetAside:
    def test_everything_is_moved_and_nothing_lost(self, filled):
        before = {
            path.relative_to(filled.path): path.read_bytes()
            for path in filled.path.rglob("*")
            if path.is_file()
        }
        attempt = filled.set_aside(segments=True)
        assert attempt == filled.path / "attempt-1"
        # The scene stays too: the folder is still claimed.
        assert {item.name for item in filled.path.iterdir()} == {"attempt-1", "scene.json"}
        assert before == {
            path.relative_to(attempt): path.read_bytes()
            for path in attempt.rglob("*")
            if path.is_file()
        }

    def test_attempts_are_numbered(self, filled):
        filled.set_aside(segments=True)
        assert filled.set_aside(segments=True) is None  # nothing new to move
        filled.write_state(state="failed")
        assert filled.set_aside(segments=True).name == "attempt-2"
        (filled.path / "attempt-1").rename(filled.path / "attempt-3")
        filled.write_state(state="failed")
        assert filled.set_aside(segments=True).name == "attempt-1"

    def test_the_folder_stays_claimed_between_two_attempts(self, filled):
        filled.set_aside(segments=True)
        filled.claim_for(scene_of(COLLISION))


def test_frames_and_snapshots_come_in_the_order_of_time(filled):
    for step in (5, 12345678901, 70):
        (filled.dumps / f"particles.{step:010d}.bin").touch()
        (filled.dumps / f"snapshot.{step:010d}.ppm").touch()
    (filled.dumps / "paraview.0000000005.vtk").touch()
    steps = [int(path.name.split(".")[1]) for path in filled.frame_files()]
    assert steps == [0, 5, 70, 12345678901]
    assert [path.suffix for path in filled.snapshot_files()] == [".ppm"] * 3


def test_every_name_is_inside_the_directory(run):
    names = ["scene", "deck", "log", "stdout", "state", "series", "engine_series", "results"]
    names += ["report", "figures", "dumps"]
    paths = [getattr(run, name) for name in names]
    assert all(path.parent == run.path for path in paths)
    assert len(set(paths)) == len(paths)
