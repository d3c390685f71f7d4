"""Files of a user are never overwritten by results that are no runs."""

from __future__ import annotations

import json

import pytest

from liggghts_driver.errors import ParseError, RunFolderError
from liggghts_driver.outputs import require_free_names, require_study_folder
from liggghts_driver.paper.figures import read_record
from liggghts_driver.paper.page import WRITTEN_BY
from liggghts_driver.paper.stored import read_stored
from liggghts_driver.paper.write import require_own_docs
from liggghts_driver.resources import cases_dir
from liggghts_driver.sweeps.plan import make_plan, write_plan


def study(folder, name="effects", scene="a"):
    """What a study leaves."""
    held = {"study": name, "provenance": {"scene_sha256": scene}}
    (folder / f"{name}.json").write_text(json.dumps(held))
    (folder / f"{name}.csv").write_text("x\n")


class TestNames:
    def test_an_empty_or_absent_folder_is_free(self, tmp_path):
        require_free_names(tmp_path, ["a.csv"])
        require_free_names(tmp_path / "none", ["a.csv"])

    def test_a_file_is_no_folder(self, tmp_path):
        (tmp_path / "made").write_text("mine")
        with pytest.raises(RunFolderError, match="is a file"):
            require_free_names(tmp_path / "made", [], ours=True)

    def test_other_files_are_in_nobody_s_way(self, tmp_path):
        (tmp_path / "b.csv").write_text("mine")
        require_free_names(tmp_path, ["a.csv"])
        with pytest.raises(RunFolderError, match=r"holds b\.csv"):
            require_free_names(tmp_path, ["a.csv", "b.csv"])


class TestStudies:
    def test_its_own_files_are_written_again(self, tmp_path):
        study(tmp_path)
        require_study_folder(tmp_path, "effects", "a")

    @pytest.mark.parametrize(("name", "scene"), [("effects", "b"), ("accuracy", "a")])
    def test_those_of_another_scene_or_study_are_not(self, tmp_path, name, scene):
        study(tmp_path, name, scene)
        (tmp_path / "effects.csv").write_text("x\n")
        with pytest.raises(RunFolderError, match=r"holds effects\.(json, effects\.)?csv"):
            require_study_folder(tmp_path, "effects", "a")

    @pytest.mark.parametrize("text", ["", "[]", '{"study": "effects"}', "\u2028"])
    def test_what_is_no_study_is_somebody_else_s(self, tmp_path, text):
        (tmp_path / "effects.json").write_text(text)
        with pytest.raises(RunFolderError, match=r"effects\.json"):
            require_study_folder(tmp_path, "effects", "a")

    def test_a_study_without_a_scene(self, tmp_path):
        study(tmp_path, "exact")
        require_study_folder(tmp_path, "exact")


class TestSweeps:
    def test_results_of_somebody_else_stay(self, tmp_path):
        plan = make_plan(cases_dir() / "sweeps" / "gradient.toml")
        (tmp_path / "results.csv").write_text("mine")
        with pytest.raises(RunFolderError, match=r"holds results\.csv"):
            write_plan(plan, tmp_path)
        assert [path.name for path in tmp_path.iterdir()] == ["results.csv"]

    def test_its_own_are_made_again(self, tmp_path):
        plan = make_plan(cases_dir() / "sweeps" / "gradient.toml")
        write_plan(plan, tmp_path)
        (tmp_path / "results.csv").write_text("the sweep's")
        write_plan(plan, tmp_path)


class TestTheStudyOfThePaper:
    def test_a_page_of_somebody_else_stays(self, tmp_path):
        (tmp_path / "paper.md").write_text("# My paper\n")
        with pytest.raises(RunFolderError, match=r"holds paper\.md .* with --docs"):
            require_own_docs(tmp_path)

    def test_its_own_is_written_again(self, tmp_path):
        (tmp_path / "images").mkdir()
        (tmp_path / "images" / "paper-flow.png").write_text("a figure")
        with pytest.raises(RunFolderError, match=r"paper-flow\.png"):
            require_own_docs(tmp_path)
        (tmp_path / "paper.md").write_text(f"# The paper\n\n{WRITTEN_BY} from here\n")
        require_own_docs(tmp_path)

    @pytest.mark.parametrize(
        "text", [b"", b"[]", b"{", b'{"form": 1}', b'{"form": 2, "sweeps": []}', b"\xff", b'"a"']
    )
    def test_stored_results_that_are_none(self, tmp_path, text):
        path = tmp_path / "results.json"
        path.write_bytes(text)
        with pytest.raises(ParseError, match="move it away"):
            read_stored(path)
        assert path.read_bytes() == text

    @pytest.mark.parametrize("text", [b"", b"{", b"3", b"\xff"])
    def test_a_record_of_figures_that_is_none(self, tmp_path, text):
        (tmp_path / "figures.json").write_bytes(text)
        with pytest.raises(ParseError, match="no record of figures"):
            read_record(tmp_path / "figures.json")
