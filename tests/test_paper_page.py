"""The page on the paper: sentences by numbers, figures by data, and the page in the repository."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from paper_results import answer, linear, point, shipped, with_points
from small_scenes import INFILTRATION, scene_of

from liggghts_driver import read_scene
from liggghts_driver.cli import main
from liggghts_driver.errors import PackingError
from liggghts_driver.identity import scene_hash
from liggghts_driver.paper import catalogue, figures, tables
from liggghts_driver.paper.catalogue import GRADIENT, SWEEPS, sweep_file
from liggghts_driver.paper.choices import choices_table
from liggghts_driver.paper.cost import cost_table
from liggghts_driver.paper.decks import deck_sha256_of
from liggghts_driver.paper.figure_snapshots import View, paint_snapshots, views
from liggghts_driver.paper.figures import DRAWINGS, SNAPSHOTS, read_record, results_sha256
from liggghts_driver.paper.page import render_page
from liggghts_driver.paper.stored import NOT_RUN, Stored, read_stored
from liggghts_driver.paper.write import record_file, results_file
from liggghts_driver.prepare import prepare
from liggghts_driver.resources import cases_dir
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.scene.layout import layout
from liggghts_driver.solve import solve
from liggghts_driver.sweeps.plan import make_plan

DOCS = Path(__file__).parents[1] / "docs"


class TestThePage:
    def test_with_nothing_run_it_says_so_everywhere(self):
        page = render_page(shipped(lambda *_: None))
        assert f"0 of {len(list(linear().points()))} points have an answer" in page
        assert page.count(NOT_RUN) > 50
        assert "nan" not in page

    def test_with_all_run_it_says_so_nowhere(self):
        page = render_page(linear())
        assert NOT_RUN not in page
        assert "A made-up processor, 4 cores" in page
        assert "14 times less" in page  # 216 s over 800 s / 50
        assert "nan" not in page

    def test_failures_are_named(self):
        def made(p):
            return point(p.values, p.replicate, answer(1e-6, verdict="invalid"))

        points = tuple(made(p) for p in linear().points("exit"))
        stored = Stored({**linear().sweeps, "exit": with_points(linear(), "exit", points)})
        page = render_page(stored)
        assert "`exit.toml`, specimen.exit = open, seed 1: invalid: a made-up reason" in page
        assert "3 invalid" in page

    def test_tables_have_as_many_cells_in_each_row(self):
        made = [
            tables.flow_table, tables.velocity_table, tables.readings_table,
            tables.exponent_table, tables.validity_table, tables.runs_table, cost_table,
            choices_table,
        ]  # fmt: skip
        for stored in (linear(), Stored()):
            for each in made:
                lines = each(stored).splitlines()
                assert len({line.count(" | ") for line in lines}) == 1, each

    def test_a_flow_that_stands_still_has_no_exponent(self):
        def rule(sweep, values, replicate):
            return 0.0 if values.get(GRADIENT) == 1.0 else 1e-6 * values.get(GRADIENT, 10.0)

        page = render_page(shipped(rule))
        assert "in some packing nothing at 1 Pa/m" in page
        assert "| with the piston, entrance | – |" in page


class TestTheCommand:
    @pytest.fixture
    def cli(self, monkeypatch, capsys, tmp_path):
        """Exit code and what was printed."""
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(figures, "DRAWINGS", DRAWINGS[2:3])  # one is enough

        def run(*arguments: str) -> tuple[int, str]:
            monkeypatch.setattr(sys, "argv", ["liggghts-driver", "study", "paper", *arguments])
            code = 0
            try:
                main()
            except SystemExit as ended:
                code = int(ended.code or 0)
            printed = capsys.readouterr()
            return code, printed.out + printed.err

        return run

    def test_without_runs_it_writes_what_is_known(self, cli, tmp_path):
        code, printed = cli("--collect-only", "--docs", "docs")
        assert code == 1  # not every point has been run
        assert "0 of 87 points have an answer" in printed
        stored = read_stored(results_file(tmp_path / "docs"))
        assert tuple(stored.sweeps) == SWEEPS
        page = (tmp_path / "docs" / "paper.md").read_text(encoding="utf-8")
        assert page == render_page(stored)
        record = read_record(record_file(tmp_path / "docs"))
        png = (tmp_path / "docs/images/paper-friction.png").read_bytes()
        assert record["paper-friction"]["sha256"] == hashlib.sha256(png).hexdigest()

    def test_a_page_of_somebody_else_stops_it_before_anything_runs(
        self, cli, tmp_path, monkeypatch
    ):
        page = tmp_path / "docs" / "paper.md"
        page.parent.mkdir()
        page.write_text("mine", encoding="utf-8")
        monkeypatch.setattr("liggghts_driver.paper.tasks.tasks_to_do", pytest.fail)
        code, printed = cli()
        assert (code, "holds paper.md" in printed) == (2, True)
        assert page.read_text(encoding="utf-8") == "mine"

    def test_json(self, cli):
        _, printed = cli("--collect-only", "--json")
        assert [s["name"] for s in json.loads(printed)["results"]["sweeps"]] == list(SWEEPS)

    def test_it_runs_what_is_to_be_done_and_finds_it_the_next_time(
        self, cli, engine, tmp_path, monkeypatch
    ):
        """A sweep of a small scene in the place of one of the shipped; the stand-in runs it."""
        cases = shutil.copytree(cases_dir(), tmp_path / "cases")
        (cases / "small.json").write_text(json.dumps(INFILTRATION), encoding="utf-8")
        (cases / "paper" / "exit.toml").write_text(
            'scene = "../small.json"\n[[axes]]\nkey = "specimen.exit"\nvalues = ["open"]\n',
            encoding="utf-8",
        )
        monkeypatch.setattr(catalogue, "cases_dir", lambda: cases)
        code, printed = cli("--only", "exit", "--cores", "1")
        assert (code, "1 of 85 points have an answer" in printed) == (0, True)
        assert "failed" not in printed
        first = read_stored(results_file(tmp_path / "docs"))
        code, _ = cli("--only", "exit")
        assert code == 0
        assert read_stored(results_file(tmp_path / "docs")) == first
        assert next(first.points("exit")).answer.flow_m3_s["entrance"].mean == 0.0

    def test_a_sweep_that_is_none(self, cli):
        code, printed = cli("--only", "nothing")
        assert code == 2
        assert "piston_follows" in printed


@pytest.fixture(scope="module")
def shipped_results():
    """What the repository holds."""
    if not results_file(DOCS).exists():
        pytest.skip("no results are stored yet: liggghts-driver study paper")
    return read_stored(results_file(DOCS))


class TestTheRepository:
    def test_the_page_is_that_of_the_stored_results(self, shipped_results):
        assert (DOCS / "paper.md").read_text(encoding="utf-8") == render_page(shipped_results)

    def test_the_stored_results_are_small(self, shipped_results):
        assert results_file(DOCS).stat().st_size < 500_000

    def test_whole_grains_do_not_fit_at_the_paper_s_fraction(self):
        """By the command that the page names; the count in the page's words."""
        scene = read_scene(cases_dir() / "infiltration.toml", ["specimen.cut=inside"])
        with pytest.raises(PackingError) as raised:
            prepare(scene)
        count, asked, fraction = (
            re.search(pattern, str(raised.value))[1]
            for pattern in (r"reached (\d+)", r"asked for (\d+)", r"at ([\d.]+), because")
        )
        words = f"({count} of {asked} did, at {fraction}:"
        assert words in (DOCS / "paper.md").read_text(encoding="utf-8")

    def test_the_figures_are_those_of_the_stored_results(self, shipped_results):
        record = read_record(record_file(DOCS))
        assert set(record) - {SNAPSHOTS} == {drawing.name for drawing in DRAWINGS}
        for name, made in record.items():
            png = (DOCS / "images" / f"{name}.png").read_bytes()
            assert made["sha256"] == hashlib.sha256(png).hexdigest()
            if name != SNAPSHOTS:
                assert made["results_sha256"] == results_sha256(shipped_results)

    def test_the_snapshots_are_those_of_a_stored_run(self, shipped_results):
        record = read_record(record_file(DOCS)).get(SNAPSHOTS)
        if record is None:
            pytest.skip("no snapshots yet")
        decks = {
            p.run: p.answer.provenance["deck_sha256"] for p in shipped_results.points() if p.answer
        }
        assert decks[record["run"]] == record["deck_sha256"]

    def test_every_point_is_that_of_the_sweeps_today(self, shipped_results):
        for name in SWEEPS:
            plan = make_plan(sweep_file(name))
            stored = [p.scene_sha256 for p in shipped_results.points(name)]
            assert stored == [scene_hash(plan.scene(p)) for p in plan.points]

    def test_the_first_deck_is_that_of_today(self, shipped_results):
        assert_decks_are_those_of_today(shipped_results, 1)

    @pytest.mark.validate
    def test_all_decks_are_those_of_today(self, shipped_results):
        assert_decks_are_those_of_today(shipped_results, None)


def assert_decks_are_those_of_today(stored: Stored, most: int | None) -> None:
    """Of so many of the points that have an answer."""
    wrong = []
    ran = [(n, p) for n in SWEEPS for p in stored.points(n) if p.answer is not None][:most]
    plans = {name: make_plan(sweep_file(name)) for name, _ in ran}
    for name, known in ran:
        planned = next(p for p in plans[name].points if p.run == known.run)
        today = deck_sha256_of(plans[name].scene(planned), known.answer.cost["ranks"])
        if today != known.answer.provenance["deck_sha256"]:
            wrong.append(f"{name}: {known.run}")
    assert not wrong


class TestSnapshots:
    def test_spheres_are_where_the_frames_have_them(self, engine, tmp_path):
        """The stand-in leaves every particle where it began."""
        scene = scene_of(INFILTRATION)
        solve(scene, tmp_path / "run", report=False)
        seen = views(RunDirectory(tmp_path / "run"), (0.0, 1e9))
        population = prepare(scene).population
        half = scene.specimen.width / 2
        behind = population.centres_m[:, 1] >= layout(scene).low[1] + half
        for view in seen:
            assert sorted(view.x_m) == pytest.approx(sorted(population.centres_m[behind, 0]))
            assert view.radius_m.sum() == pytest.approx(population.radii_m[behind].sum())
        grains = behind[population.particles :].sum()
        assert np.isnan(seen[0].velocity_m_s).sum() == grains
        assert seen[1].time_s > seen[0].time_s == 0.0

    def test_they_are_painted_with_the_piston(self):
        places = np.array([-0.05, 0.05])
        speeds = np.array([1e-3, np.nan])
        view = View(5.0, places, 0.0 * places, np.array([1e-3, 1e-2]), speeds, -0.1)
        figure = Figure()
        paint_snapshots([view] * 2, (-0.2, -0.05, -0.05), (0.1, 0.05, 0.05), figure)
        assert [axes.get_title(loc="left") for axes in figure.axes[:2]] == ["t = 5 s"] * 2
        assert figure.axes[0].lines[-1].get_xdata()[0] == pytest.approx(-100.0)  # mm
