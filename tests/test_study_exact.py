"""The study of exact problems: its references, its fits and its judgement, without an engine."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from scipy.integrate import solve_ivp
from small_scenes import COLLISION, scene_of

from liggghts_driver.case import make_case
from liggghts_driver.cli import main, study
from liggghts_driver.physics.contact import elastic_duration_s, largest_overlap_m
from liggghts_driver.physics.drag import free_flight_speed_m_s
from liggghts_driver.studies import exact, exact_collisions, exact_problems
from liggghts_driver.studies.exact import (
    Expected,
    Knob,
    Measured,
    Moved,
    Problem,
    Trial,
    fitted_order,
    tasks_of,
)
from liggghts_driver.studies.exact_collisions import APPROACH_M_S, contact, contact_time_s
from liggghts_driver.studies.exact_contacts import Row
from liggghts_driver.studies.exact_falls import Fall, Immersed, Launch
from liggghts_driver.studies.exact_figure import apart, draw_exact, paint_exact, panels_of
from liggghts_driver.studies.exact_report import bugs, write_results
from liggghts_driver.sweeps.task import Outcome

#: References are integrated to ten digits; a few steps of them keep nine.
NINE_DIGITS = 1e-9
STILL = Moved(
    1e-3, 10, 5, 0.2, np.zeros(1), np.zeros((1, 1, 3)), np.zeros((1, 1, 3)), pd.DataFrame()
)


def measured(
    power: float, expected: float = 1.0, title: str = "sphere", quantity: str = "place"
) -> Measured:
    """Errors that go exactly with a power of the knob."""
    values = (0.1, 0.2, 0.4)
    trials = tuple(Trial(v, scene_of(COLLISION), lambda _run: {}) for v in values)
    wanted = Expected(quantity, expected, 0.1, "it is so")
    knob = Knob("held", "step / time", trials, (wanted,))
    problem = Problem("p", title, "steps per run", (knob,))
    errors = tuple(0.01 * v**power for v in values)
    return Measured(problem, knob, wanted, values, errors, (4.0, 2.0, 1.0), (STILL,) * 3)


RIGHT, WRONG = measured(1.05), measured(1.2, quantity="velocity")


class TestFit:
    def test_powers_are_found(self):
        values = np.array([1.0, 3.0, 10.0])
        for power in (-0.4, 0.0, 2.5):
            # Of a pure power nothing but rounding is left.
            assert fitted_order(values, 7.0 * values**power) == pytest.approx(power, abs=1e-12)

    @pytest.mark.parametrize(
        ("values", "errors"),
        [([1.0], [2.0]), ([], []), ([1.0, 2.0], [0.0, 1.0]), ([1.0, 2.0], [math.nan, 1.0])],
        ids=["one value", "nothing", "no error", "not a number"],
    )
    def test_too_little_is_no_order(self, values, errors):
        assert math.isnan(fitted_order(values, errors))


class TestJudgement:
    def test_an_order_is_right_within_its_tolerance(self):
        assert RIGHT.is_right
        assert not WRONG.is_right
        assert WRONG.order == pytest.approx(1.2)

    def test_what_is_not_known_is_not_right(self):
        assert not replace(RIGHT, knob_values=(), errors=(), costs=(), runs=()).is_right

    def test_a_wrong_order_is_named_with_what_is_expected_and_why(self):
        assert bugs([RIGHT]) == []
        (said,) = bugs([RIGHT, WRONG])
        assert said == (
            "bug: sphere: the error of held, velocity goes with the step^1.20, where 1 +- 0.1 is "
            "expected: it is so"
        )
        nothing = replace(WRONG, knob_values=(), errors=(), costs=(), runs=())
        assert "velocity is not known, where" in bugs([nothing])[0]


@pytest.fixture(scope="module")
def problems() -> list[Problem]:
    """All of them, with few spheres."""
    return exact_problems.exact_problems(pairs=4, spheres=10)


class TestProblems:
    def test_every_scene_can_be_run_with_the_step_and_the_interval_asked_for(self, problems):
        for problem in problems:
            for knob in problem.knobs:
                plans = [make_case(trial.scene).time for trial in knob.trials]
                for trial, plan in zip(knob.trials, plans, strict=True):
                    # Whole numbers of steps; only the last digits differ.
                    assert plan.step_s == pytest.approx(trial.scene.time.step, rel=1e-12)
                    if trial.scene.drag.refresh is not None:
                        kept = plan.refresh_every * plan.step_s
                        assert kept == pytest.approx(trial.scene.drag.refresh, rel=1e-12)

    def test_knobs_are_turned_from_the_finest_on(self, problems):
        for problem in problems:
            for knob in problem.knobs:
                values = [trial.value for trial in knob.trials]
                finest_first = sorted(values, reverse=knob.word == "stiffness")
                assert values == finest_first
                assert len(set(values)) == len(values) >= 4

    def test_a_scene_stands_where_the_knob_does(self, problems):
        scales = [trial.scene.contact.stiffness_scale for trial in problems[2].knobs[0].trials]
        assert scales == [trial.value for trial in problems[2].knobs[0].trials]
        for problem in problems[:2]:
            for trial in problem.knobs[0].trials:
                share = trial.scene.time.step / contact_time_s()
                assert share == pytest.approx(trial.value, rel=1e-12)  # rounding

    def test_every_expectation_has_a_tolerance_and_a_reason(self, problems):
        for problem in problems:
            for knob in problem.knobs:
                for expected in knob.expected:
                    assert 0.0 < expected.within <= 0.15
                    assert expected.why

    def test_every_second_value_has_the_finest(self, problems):
        for full, half in zip(problems, exact_problems.exact_problems(4, 10, 2), strict=True):
            for knob, fewer in zip(full.knobs, half.knobs, strict=True):
                assert [t.value for t in fewer.trials] == [t.value for t in knob.trials][::2]

    def test_tasks_have_names_and_folders_of_their_own(self, problems, tmp_path):
        tasks = tasks_of(problems, tmp_path)
        assert len({task.name for task in tasks}) == len(tasks)
        assert len({task.folder for task in tasks}) == len(tasks)
        # The damped collision in steps of 1/80 is the softened one with a scale of 1.
        trials = sum(len(knob.trials) for problem in problems for knob in problem.knobs)
        starts = sum(problem.start is not None for problem in problems)
        assert len(tasks) == trials + starts - 1


class TestMeasure:
    def test_costs_are_those_of_stepping(self, monkeypatch, tmp_path):
        start, finest, coarsest = (scene_of(COLLISION, {"seed": n}) for n in range(3))
        core_s = {start.seed: 0.5, finest.seed: 2.5, coarsest.seed: 1.0}
        monkeypatch.setattr(
            exact, "_read", lambda scene, _runs: replace(STILL, core_s=core_s[scene.seed])
        )
        trials = tuple(
            Trial(value, scene, lambda _run, e=value: {"place": e})
            for value, scene in ((0.1, finest), (0.2, coarsest))
        )
        knob = Knob("", "step / time", trials, (Expected("place", 1.0, 0.1, "so"),))
        problem = Problem("p", "P", exact.CORE_TIME, (knob,), start)
        (found,) = exact.measure([problem], tmp_path)
        assert found.costs == (2.0, 0.5)
        assert found.order == pytest.approx(1.0)
        counted = tuple(replace(trial, steps=10.0 / trial.value) for trial in trials)
        problem = Problem("p", "P", "steps", (replace(knob, trials=counted),))
        (found,) = exact.measure([problem], tmp_path)
        assert found.costs == (100.0, 50.0)

    def test_what_did_not_finish_is_left_out(self, tmp_path):
        problem = WRONG.problem
        (found,) = exact.measure([problem], tmp_path)
        assert found.errors == ()
        assert not found.is_right

    def test_a_perfect_collision_has_no_error(self):
        """Frames as an exact engine would write them: before, at the deepest instant, after."""
        should = contact(1.0).collide(APPROACH_M_S, np.array([contact_time_s() / 2.0]))
        gap, deepest, late = 1e-5, float(should.overlaps_m[0]), 2e-3
        times = np.array([0.0, gap / APPROACH_M_S + should.duration_s / 2.0, late])
        after = (late - gap / APPROACH_M_S - should.duration_s) * APPROACH_M_S
        half = np.array([gap, -deepest, after]) / 2.0 + exact_collisions.RADIUS_M
        speeds = exact_collisions.SPEED_M_S * np.array([-1.0, 0.0, 1.0])
        positions, velocities = np.zeros((2, 3, 2, 3))
        positions[:, :, 0] = np.array([-half, half]).T
        velocities[:, :, 0] = np.array([-speeds, speeds]).T
        run = replace(STILL, times_s=times, positions_m=positions, velocities_m_s=velocities)
        errors = exact_collisions.collision_errors(1.0, 1.0, run)
        for quantity in ("restitution", "duration", "energy in contact"):
            # Differences of places 150 times as large as the overlap.
            assert errors[quantity] < 1e-6, quantity
        assert errors["overlap / radius"] == pytest.approx(deepest / 1.5e-3, rel=1e-6)


class TestReferences:
    def test_an_elastic_collision(self):
        body = exact_collisions._body(1.0)
        pair = contact(1.0)
        lasts = elastic_duration_s(body, body, APPROACH_M_S)
        found = pair.collide(APPROACH_M_S, np.array([lasts / 2.0]))
        assert found.duration_s == pytest.approx(lasts, rel=1e-6)  # its factor is rounded there
        assert found.parting_m_s == pytest.approx(APPROACH_M_S, rel=NINE_DIGITS)
        deepest = largest_overlap_m(body, body, APPROACH_M_S)
        assert found.overlaps_m[0] == pytest.approx(deepest, rel=NINE_DIGITS)
        energy = 0.5 * pair.mass_kg * APPROACH_M_S**2
        assert pair.elastic_energy_j(found.overlaps_m)[0] == pytest.approx(energy, rel=NINE_DIGITS)
        assert pair.elastic_energy_j(np.array([-1e-5]))[0] == 0.0

    @pytest.mark.parametrize("restitution", [0.1, 0.5, 0.9])
    def test_a_damped_collision_parts_with_its_restitution(self, restitution):
        found = contact(restitution).collide(APPROACH_M_S, np.zeros(1))
        assert found.parting_m_s == pytest.approx(restitution * APPROACH_M_S, rel=1e-8)

    @pytest.mark.parametrize("reynolds", [0.1, 50.0])
    def test_a_launched_sphere(self, reynolds):
        """The closed form is what the equation of motion gives, integrated."""
        sphere = Immersed(1e-3, 2500.0, 1000.0, 1e-3)
        launch = Launch(sphere, sphere.speed_at(reynolds))
        branch = sphere.branch_at(reynolds)
        times = np.linspace(0.0, 2.0 * launch.relaxation_s, 9)
        found = solve_ivp(
            lambda _t, u: [-sphere.drag_n(u[0], branch) / sphere.mass_kg, u[0]],
            (0.0, times[-1]),
            [launch.speed_m_s, 0.0],
            method="DOP853",
            rtol=1e-11,
            atol=1e-18,
            t_eval=times,
        )
        assert launch.speeds_m_s(times) == pytest.approx(found.y[0], rel=NINE_DIGITS)
        assert launch.ways_m(times) == pytest.approx(found.y[1], rel=NINE_DIGITS, abs=1e-15)

    @pytest.mark.parametrize("force", [1e-9, 1e-6, 1e-3])
    def test_a_pushed_sphere_ends_at_its_free_flight(self, force):
        fall = Fall(Immersed(1e-3, 2500.0, 1000.0, 1e-3), force)
        closed = free_flight_speed_m_s(1000.0, 1e-3, 1e-3, force)
        assert fall.final_speed_m_s == pytest.approx(closed, rel=NINE_DIGITS)
        times = np.array([0.0, 30.0, 31.0]) * fall.relaxation_s
        speeds, ways = fall.motion(times)
        assert speeds[0] == ways[0] == 0.0
        # exp(-30) of the start is left.
        assert speeds[-1] == pytest.approx(closed, rel=NINE_DIGITS)
        assert ways[2] - ways[1] == pytest.approx(closed * fall.relaxation_s, rel=1e-7)

    def test_an_elastic_row_keeps_its_energy(self):
        plane = replace(contact(1.0), mass_kg=1e-4, radius_m=1.5e-3)
        row = Row(1, 1.5e-3, 1e-4, 3e-3, 3e-3, plane, contact(1.0))
        place, sphere, speed, spin = row.motion(np.linspace(0.0, 0.01, 20))
        overlaps = np.array([1.5e-3 - (sphere - place), 1.5e-3 - (3e-3 - sphere)])
        stored = plane.elastic_energy_j(overlaps).sum(axis=0)
        energy = 0.5 * 3e-3 * speed**2 + 0.5 * 1e-4 * spin**2 + stored - 3e-3 * place
        # The places are integrated to 1e-15 m, the largest part of this.
        assert np.abs(energy).max() < 1e-7 * stored.max()


class TestFiles:
    def test_they_agree(self, tmp_path):
        results = write_results([RIGHT, WRONG], {"a run": "why"}, tmp_path, ["me"])
        assert json.loads((tmp_path / "exact.json").read_text()) == results
        assert [row["right"] for row in results["orders"]] == [True, False]
        assert results["failed"] == {"a run": "why"}
        assert len(results["bugs"]) == 1
        table = pd.read_csv(tmp_path / "exact.csv")
        assert len(table) == 6
        assert table["error"].tolist() == pytest.approx([*RIGHT.errors, *WRONG.errors])
        assert set(table["steps"]) == {10}
        assert (tmp_path / "exact.png").read_bytes().startswith(b"\x89PNG")

    def test_nothing_finished_still_has_files(self, tmp_path):
        nothing = replace(WRONG, knob_values=(), errors=(), costs=(), runs=())
        results = write_results([nothing], {}, tmp_path)
        assert results["orders"][0]["measured_order"] is None
        assert (tmp_path / "exact.png").exists()


class TestFigure:
    def painted(self, lines: list[Measured]) -> Figure:
        figure = Figure()
        paint_exact(panels_of(lines), figure)
        return figure

    def test_orders_stand_beside_the_lines_and_in_the_legend(self):
        axes = self.painted([RIGHT, WRONG]).axes[0]
        texts = [text.get_text() for text in axes.texts]
        assert texts == ["1.05", "1.20 off"]
        legend = [text.get_text() for text in axes.get_legend().get_texts()]
        assert legend == ["held, place: 1 in step", "held, velocity: 1 in step"]
        assert axes.get_xlabel() == "steps per run"
        assert axes.get_title(loc="left") == "sphere"

    def test_a_crowded_problem_has_a_panel_for_each_quantity(self):
        lines = [RIGHT, RIGHT, RIGHT, WRONG, WRONG]
        assert [title for title, _ in panels_of(lines)] == ["sphere: place", "sphere: velocity"]
        legend = self.painted(lines).axes[0].get_legend()
        assert legend.get_texts()[0].get_text() == "held: 1 in step"

    def test_labels_do_not_meet(self):
        assert apart([0.5, 0.1], 0.2) == [0.5, 0.1]
        assert apart([0.5, 0.5, 0.4], 0.2) == pytest.approx([0.6, 0.8, 0.4])
        assert apart([0.95, 0.94], 0.2) == pytest.approx([1.0, 0.8])  # none above the axis

    def test_equal_data_give_equal_files(self):
        assert draw_exact([RIGHT, WRONG]) == draw_exact([RIGHT, WRONG])


@pytest.fixture
def cli(monkeypatch, capsys, tmp_path):
    """Run ``study exact`` on what is measured already; code, out, err."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")

    def run(found: list[Measured], *arguments: str, ending: str = "done"):
        monkeypatch.setattr(exact_problems, "exact_problems", list)
        monkeypatch.setattr(exact, "measure", lambda *_: found)
        monkeypatch.setattr(study, "_run", lambda *_, **__: {"a run": Outcome(ending, "why")})
        monkeypatch.setattr(sys, "argv", ["liggghts-driver", "study", "exact", *arguments])
        code = 0
        try:
            main()
        except SystemExit as ended:
            code = ended.code or 0
        return code, *capsys.readouterr()

    return run


class TestCommand:
    def test_the_table(self, cli, tmp_path):
        code, out, err = cli([RIGHT])
        assert (code, err) == (0, "")
        assert "all 1 orders are as expected" in out
        assert max(map(len, out.splitlines())) <= 80
        words = out.split("held, place")[1].split()
        assert words[:3] == ["step", "1.00", "1.05"]
        assert (tmp_path / "runs" / "study-exact" / "exact.csv").exists()

    def test_a_wrong_order_ends_with_1_and_is_named(self, cli):
        code, out, _ = cli([RIGHT, WRONG], "--out", "made")
        assert code == 1
        assert "1.20 off" in out
        assert "bug: sphere: the error of held, velocity goes with the step^1.20" in out
        assert "as expected" not in out

    def test_a_failed_run_ends_with_1(self, cli):
        assert cli([RIGHT], ending="failed")[0] == 1

    def test_json_is_one_document(self, cli):
        code, out, err = cli([WRONG], "--json", "--out", "made")
        document = json.loads(out)
        assert (code, err) == (1, "")
        assert document["orders"][0]["measured_order"] == pytest.approx(1.2)
        assert document["folder"] == "made"
        assert document["provenance"]["command"][1:3] == ["study", "exact"]
