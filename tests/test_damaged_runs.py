"""Run directories that lost something after they were written: never believed, never lost."""

from __future__ import annotations

import pytest
from test_interruption import assert_whole, interrupt

from liggghts_driver.errors import RunFolderError
from liggghts_driver.results.answer import analyse
from liggghts_driver.run import run_case


def cut(path, keep=0.6):
    """Leave the first part of a file."""
    data = path.read_bytes()
    path.write_bytes(data[: int(keep * len(data))])


class TestFinished:
    @pytest.mark.parametrize(
        ("name", "words"),
        [
            ("series.txt", "or has gaps"),
            ("log.liggghts", "stopped at step"),
        ],
    )
    def test_a_file_that_is_cut_off(self, engine, case, run, name, words):
        run_case(case, run)
        cut(run.path / name)
        with pytest.raises(RunFolderError, match=f"not whole any more: .*{words}"):
            run_case(case, run)

    def test_an_empty_log(self, engine, case, run):
        run_case(case, run)
        run.log.write_text("")
        with pytest.raises(RunFolderError, match="no row of the series"):
            run_case(case, run)

    def test_frames_that_are_gone(self, engine, case, run):
        run_case(case, run)
        gone = run.frame_files()[len(run.frame_files()) // 2 :]
        for path in gone:
            path.unlink()
        words = f"the frame of step {run.step_of(gone[0])} is not there"
        with pytest.raises(RunFolderError, match=words):
            run_case(case, run)

    def test_a_deck_that_is_no_text_is_another(self, engine, case, run):
        run_case(case, run)
        run.deck.write_bytes(b"\xff" + run.deck.read_bytes())
        with pytest.raises(RunFolderError, match=r"its deck\.in is not what"):
            run_case(case, run)


class TestUnfinished:
    """What cannot be gone on with is kept, and the run begins again with a word."""

    @pytest.mark.parametrize(
        ("damage", "words"),
        [
            (lambda segment: next(segment.restarts.iterdir()).unlink(), "restart is not there"),
            (lambda segment: cut(next(segment.restarts.iterdir())), "of its"),
            (lambda segment: cut(segment.checkpoint), "no checkpoint"),
            (lambda segment: segment.checkpoint.write_text("[]"), "no checkpoint"),
            (lambda segment: cut(segment.engine_series), "or has gaps"),
            (lambda segment: segment.engine_series.unlink(), "wrote no series"),
            (lambda segment: cut(next(iter(sorted(segment.dumps.iterdir())))), "a frame is cut"),
            (lambda segment: segment.deck.write_bytes(b"\xff\n"), "its deck.in is not what"),
        ],
    )
    def test_it_begins_again(self, engine, case, run, damage, words):
        engine("slow")
        interrupt(case, run)
        damage(run.segments()[0])
        engine("")
        steps: list[int] = []
        notes: list[str] = []
        finished = run_case(case, run, on_step=steps.append, on_note=notes.append)
        assert min(steps) == 0
        assert_whole(case, run)
        assert (run.path / "attempt-1" / "segments" / "1").is_dir()
        (told,) = notes
        assert words in told
        assert told.endswith(str(run.path / "attempt-1"))
        assert told in analyse(finished).results["notes"]
        # And whoever finds it finished is told as well.
        assert run_case(case, run).begun_again == told

    def test_a_folder_beside_the_segments_is_none_of_them(self, engine, case, run):
        engine("slow")
        interrupt(case, run)
        (run.path / "segments" / "02x").mkdir()
        engine("")
        finished = run_case(case, run)
        assert_whole(case, run)
        assert run.read_state()["continuations"] == 1
        assert finished.begun_again is None
