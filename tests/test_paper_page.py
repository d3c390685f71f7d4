"""The page on the paper: sentences by numbers, figures by data, and the page in the repository."""

from __future__ import annotations

import hashlib
import json
import shutil
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from paper_results import answer, point, power_law, shipped
from small_scenes import INFILTRATION, scene_of

from liggghts_driver.cli import main
from liggghts_driver.identity import scene_hash
from liggghts_driver.paper import answers, catalogue, explain, figures, page, tables
from liggghts_driver.paper.catalogue import (
    ALL_GRADIENTS,
    GRADIENT,
    MAIN,
    READINGS,
    SWEEPS,
    sweep_file,
)
from liggghts_driver.paper.decks import deck_sha256_of
from liggghts_driver.paper.figure_snapshots import View, paint_snapshots, views
from liggghts_driver.paper.figures import DRAWINGS, SNAPSHOTS, read_record, results_sha256
from liggghts_driver.paper.page import render_page
from liggghts_driver.paper.stored import Stored, read_stored
from liggghts_driver.paper.validity import validity_answer
from liggghts_driver.paper.verdict import reading_answer
from liggghts_driver.paper.words import NOT_RUN
from liggghts_driver.paper.write import record_file, results_file
from liggghts_driver.prepare import prepare
from liggghts_driver.resources import cases_dir
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.scene.layout import layout
from liggghts_driver.solve import solve
from liggghts_driver.sweeps.plan import make_plan

DOCS = Path(__file__).parents[1] / "docs"


@cache
def linear() -> Stored:
    """All runs there, the flow proportional to the gradient; at 10 Pa/m nearly the paper's."""
    return shipped(power_law(1.0))


@cache
def as_free_flight() -> Stored:
    return shipped(power_law(0.74, at_ten=1.2e-6))


class TestAnswers:
    def test_a_reading_that_agrees_is_named(self):
        """Entrance 1.9 and middle 1.52, of the paper's 1.97 and 1.86, ± 0.14 between packings."""
        found = reading_answer(linear())
        assert found[0].startswith("No: over the second half no reading that ran with several")
        assert "at the entrance alone fluid outside with the piston, outside v_f = a t" in found[0]
        assert not any(NOT_RUN in sentence for sentence in found)

    def test_one_packing_decides_nothing(self):
        """Not even at half the paper's flow rate."""
        found = reading_answer(shipped(lambda s, v, n: 1e-6 if n == 0 else None))[0]
        assert found.startswith(
            "Not decided: over the second half no reading with several packings"
        )
        assert "One packing, which decides nothing: fluid outside with the piston" in found

    def test_what_the_settings_may_explain_is_not_decided(self):
        """Entrance 4 % below and middle 4 % above with hardly any spread: within 5 %."""
        found = reading_answer(self.gradient_alone(1.97e-6 * 0.96, 1.86e-6 * 1.04))[0]
        assert found.startswith("Not decided: over the second half fluid outside with the piston")

    def test_the_two_outside_fluids_on_both_sides_of_the_paper(self):
        def rule(sweep, values, replicate):
            return {"gradient": 1.5e-6, "outside_fluid": 2.5e-6}.get(sweep)

        found = reading_answer(shipped(rule))
        assert found[0].endswith(
            "entrance, 1.50 to 2.50 around 1.97; middle, 1.20 to 2.00 around 1.86."
        )
        assert "entrance, steady in 3 of 3 packings" in found[1]
        assert "lies between" not in reading_answer(linear())[0]

    @staticmethod
    def gradient_alone(*flows_m3_s):
        """The first reading alone has run, and has the same flow rates in all packings."""
        made = {
            name: tuple(
                point(p.values, p.replicate, answer(*flows_m3_s) if name == "gradient" else None)
                for p in sweep.points
            )
            for name, sweep in linear().sweeps.items()
        }
        return Stored({n: figures_sweep(linear(), n, points) for n, points in made.items()})

    def test_both_sections_must_agree(self):
        found = reading_answer(self.gradient_alone(1.97e-6, 1.86e-6))[0]
        assert found.startswith("Yes: over the second half fluid outside with the piston agrees")
        found = reading_answer(self.gradient_alone(1.97e-6, 1.2e-6))[0]
        assert found.startswith("No: over the second half")

    def test_proportional_flow(self):
        found = answers.power_answer(linear())
        assert found[0].startswith(
            'At the entrance the flow goes with the gradient in the reading "with the piston"'
        )
        main = next(s for s in found if s.startswith('"with the piston"'))
        assert "entrance (1 to 10 Pa/m), 1.00" in main
        assert "which may be 1;" in main

    def test_free_flight(self):
        found = answers.power_answer(as_free_flight())
        assert found[0].startswith("At the entrance the flow does not go with the gradient")
        assert any("0.740" in s and "which may be 0.74" in s for s in found)

    def test_a_wide_interval_does_not_make_it_linear(self):
        """Powers 0.6, 0.9 and 1.2: 0.9 ± 0.75 has both 1 and 0.74 in it."""

        def rule(sweep, values, replicate):
            return 1.9e-6 * (values.get(GRADIENT, 10.0) / 10.0) ** (0.6 + 0.3 * replicate)

        found = answers.power_answer(shipped(rule))
        assert found[0].startswith("At the entrance proportional cannot be told from free flight")
        assert any("which cannot tell 1 from 0.74" in sentence for sentence in found)

    def test_a_line_that_is_crossed_is_not_followed(self):
        """A flow with the 0.74th power crosses the law's line where (g / 10)^0.26 = 1.2 / 1.86."""
        entrance, middle = validity_answer(as_free_flight(), ALL_GRADIENTS)
        assert "above it at 1 Pa/m" in entrance
        assert "it crosses the line between 1 and 5 Pa/m" in entrance
        assert "it runs along the line nowhere (power of the gradient from 1 to 50 Pa/m 0.7" in (
            entrance
        )
        assert middle.startswith("Middle: beside the law's line, the flow is")

    def test_where_the_law_ends(self):
        """Proportional as the law up to 10 Pa/m, and as the root of the gradient beyond."""

        def rule(sweep, values, replicate):
            ratio = values.get(GRADIENT, 10.0) / 10.0
            return 1.86e-6 * (1 + 0.01 * replicate) * min(ratio, ratio**0.5)

        entrance = validity_answer(shipped(rule), ALL_GRADIENTS)[0]
        assert "it follows the line from 1 to 10 Pa/m (power of the gradient 1.0" in entrance
        assert entrance.endswith("and is below it from 14 Pa/m on, Re = 10.")

    def test_a_flow_that_never_met_the_line_does_not_leave_it(self):
        found = validity_answer(shipped(power_law(1.0, at_ten=1e-6)), MAIN)[0]
        assert found == (
            "Entrance: beside the law's line, the flow is below it at 1, 2, 5, 10 and 20 Pa/m."
        )

    def test_friction_that_stops_the_flow_is_said_to(self):
        def rule(sweep, values, replicate):
            share = {0.1: 0.5, 0.2: 0.2, 0.5: 0.001}.get(values.get("contact.friction"), 1.0)
            return 1.9e-6 * share * (1.0 + 0.03 * (replicate - 1))

        found = explain.friction_answer(shipped(rule))
        assert ["is obstructed" in sentence for sentence in found] == [False, False, True]
        assert "Friction 0.1, rolling " in found[0]
        assert "not obstructed: 50 % remains" in found[0]
        assert "changes by \u221250" in found[0]

    def test_what_moves_the_flow_and_what_does_not(self):
        def rule(sweep, values, replicate):
            chance = {"exit": 0.05, "grains": 0.01}.get(sweep, 0.0) * (replicate - 1)
            whole = values.get("specimen.cut") == "inside"
            return 1.9e-6 * ((1.3 if whole else 1.0) + chance * (whole or sweep == "exit"))

        found = next(s for s in explain.explain_answer(shipped(rule)) if s.startswith("Entrance"))
        moved, rest = found.split("; no change beyond chance: ")
        assert "whole grains inside (0.50) (+30.0 ± 2.5 %)" in moved
        assert "exit open" in rest

    def test_whole_grains_are_held_against_cut_ones_at_the_same_fraction(self):
        """And not against the first reading, from which they differ in two things."""

        def rule(sweep, values, replicate):
            return 1.9e-6 * {"inside": 1.8, "bulk": 1.5}.get(values.get("specimen.cut"), 1.0)

        stored = shipped(rule)
        whole = next(each for each in READINGS if "whole" in each.title)
        assert explain.change_of(stored, whole, "entrance").mean == pytest.approx(0.2)

    def test_how_densely_particles_lie_before_the_entrance(self):
        """307.5 cm3 of them at the start; what is left of them, over 0.1 m x 0.1 m x the gap."""
        made_up = answer(1.9e-6)
        first, last = (-1e-6 * made_up.curves.piston_x_um[n] for n in (0, -1))
        passed_m3 = 1.9e-6 * 99 * 0.5
        expected = (0.15 * 0.01 * first - passed_m3) / (0.01 * last)
        assert explain._before_entrance(made_up) == pytest.approx(expected, rel=1e-3)

    def test_what_a_step_costs(self):
        """The made-up runs take 16 s for a second, in steps of 0.5 ms; the paper 216 in 0.1 ms."""
        sentence = page._cost(linear())
        assert "takes 16.0 s" in sentence
        assert "14 times less, of which 5.0 by a longer step" in sentence
        assert "A step takes 8.0 ms, the paper's 22 ms: 2.7 times less." in sentence

    def test_steadiness(self):
        found = answers.steady_answer(linear())
        assert "steady in 3 of 3 packings" in found[0]
        assert "no steady flow" not in " ".join(found)
        assert "12.0 s at 10" in found[-1]
        assert "after the 10 s" in found[-1]

    def test_what_if(self):
        found = explain.what_if_answer(linear())
        assert [sentence.split(",")[0] for sentence in found] == [
            "v_p = 0.1",
            "v_p = 0.15",
            "v_p = 0.25",
        ]
        # Eq. 6 is accurate up to 0.15.
        assert ["not to hold" in sentence for sentence in found] == [False, False, True]


def figures_sweep(stored, name, points):
    sweep = stored.sweeps[name]
    return type(sweep)(name, sweep.title, sweep.settings, points)


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
        stored = Stored({**linear().sweeps, "exit": figures_sweep(linear(), "exit", points)})
        page = render_page(stored)
        assert "`exit.toml`, specimen.exit = open, seed 1: invalid: a made-up reason" in page
        assert "3 invalid" in page

    def test_tables_have_as_many_cells_in_each_row(self):
        made = [
            tables.flow_table, tables.velocity_table, tables.readings_table,
            tables.exponent_table, tables.validity_table, tables.runs_table, tables.cost_table,
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
        assert "0 of 84 points have an answer" in printed
        stored = read_stored(results_file(tmp_path / "docs"))
        assert tuple(stored.sweeps) == SWEEPS
        page = (tmp_path / "docs" / "paper.md").read_text(encoding="utf-8")
        assert page == render_page(stored)
        record = read_record(record_file(tmp_path / "docs"))
        png = (tmp_path / "docs/images/paper-friction.png").read_bytes()
        assert record["paper-friction"]["sha256"] == hashlib.sha256(png).hexdigest()

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
        assert (code, "1 of 82 points have an answer" in printed) == (0, True)
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
