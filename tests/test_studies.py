"""The study of effects: which runs, in which order, and what is made of their numbers."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from small_scenes import COLLISION, FLUID, INFILTRATION, case_of, changed, scene_of

from liggghts_driver.cli import main
from liggghts_driver.effects import active_effects
from liggghts_driver.engine.stop import Stop
from liggghts_driver.errors import ParseError, SceneError
from liggghts_driver.identity import scene_hash
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.studies import measured, observables
from liggghts_driver.studies.effects import whole_case, write_results
from liggghts_driver.studies.figure import draw_effects, paint_effects
from liggghts_driver.studies.measured import measure
from liggghts_driver.studies.observables import main_observable, observe, title_of, unit_of
from liggghts_driver.studies.paired import paired_change, paired_ratio
from liggghts_driver.studies.tasks import run_tasks, tasks_in_turn
from liggghts_driver.studies.variants import variants_of
from liggghts_driver.sweeps.task import Outcome

if TYPE_CHECKING:
    from pathlib import Path

    from liggghts_driver.scene.model import Scene

GRAVITY = {"acceleration": [0.0, 0.0, -9.81]}
#: A scene with everything that can be left out.
RICH = {
    "contact.friction": 0.3,
    "contact.rolling_friction": 0.05,
    "fluid": FLUID,
    "gravity": GRAVITY,
    "pressure": {"gradient": 10.0},
}
#: Two effects that can be left out, and one.
FRICTION = {"contact.friction": 0.3, "contact.rolling_friction": 0.05}
RUBBING = {"contact.friction": 0.3}
#: Arithmetic in doubles: what is left is rounding.
ROUNDING = 1e-12


class TestVariants:
    def test_the_whole_scene_then_each_effect_that_can_be_left_out(self):
        names = [variant.name for variant in variants_of(scene_of(COLLISION, RICH))]
        assert names == [
            "all-effects",
            *(f"without-{name}" for name in ("friction", "rolling", "pressure", "drag")),
            *(f"without-{name}" for name in ("gravity", "buoyancy")),
        ]

    @pytest.mark.parametrize("tables", [COLLISION, INFILTRATION], ids=["collision", "infiltration"])
    def test_what_is_left_out_is_out_and_nothing_else(self, tables):
        scene = scene_of(tables, RICH)
        whole = {effect.name for effect in active_effects(scene)}
        for variant in variants_of(scene)[1:]:
            left = {effect.name for effect in active_effects(variant.scene(scene, 1))}
            assert whole - left == {effect.name for effect in variant.left_out}
            assert left <= whole

    def test_what_needs_an_effect_goes_with_it(self):
        found = {
            variant.name: {effect.name for effect in variant.follows}
            for variant in variants_of(scene_of(COLLISION, RICH))
        }
        assert found["without-friction"] == {"rolling", "rotation"}
        assert found["without-gravity"] == {"buoyancy"}
        assert found["without-rolling"] == set()

    def test_only_the_seed_and_the_effect_differ(self):
        scene = scene_of(INFILTRATION, {**RICH, "seed": 7})
        base, *_ = variants_of(scene)
        assert scene_hash(base.scene(scene, 7)) == scene_hash(scene)
        assert base.scene(scene, 9) == scene.model_copy(update={"seed": 9})

    def test_nothing_is_screened(self):
        scene = scene_of(COLLISION, {**RICH, "effects.screen": 0.5})
        assert all(v.scene(scene, 1).effects.screen == 0.0 for v in variants_of(scene))

    def test_no_effect_to_leave_out(self):
        assert len(variants_of(scene_of(COLLISION))) == 1

    def test_titles_are_names(self):
        titles = [variant.title for variant in variants_of(scene_of(COLLISION, RICH))]
        assert len(set(titles)) == len(titles)


class TestPaired:
    """Numbers that a hand can check."""

    def test_the_change_is_that_of_each_pair(self):
        # Changes of 10, 20 and 30 %, of bases far apart: mean 0.2, standard deviation 0.1.
        base = {1: 1.0, 2: 100.0, 3: 10.0}
        change = paired_change({1: 1.1, 2: 120.0, 3: 13.0}, base)
        assert change.mean == pytest.approx(0.2, rel=ROUNDING)
        # Student's t for 2 degrees of freedom, from a table: 4.303, to four digits.
        assert change.ci95 == pytest.approx(4.303 * 0.1 / 3**0.5, rel=2e-4)
        assert change.replicates == 3

    def test_two_replicates(self):
        # t = 12.706 for 1 degree of freedom, to five digits; the deviation of 0 and 0.2 is
        # 0.2 / sqrt(2), and that over sqrt(2) is 0.1.
        change = paired_change({1: 1.0, 2: 1.2}, {1: 1.0, 2: 1.0})
        assert change.ci95 == pytest.approx(12.706 * 0.1, rel=2e-5)

    def test_one_replicate_has_no_interval(self):
        change = paired_change({4: 3.0}, {4: 2.0})
        assert (change.mean, change.ci95, change.replicates) == (0.5, None, 1)

    def test_seeds_without_a_partner_do_not_count(self):
        assert paired_change({1: 2.0, 3: 9.0}, {1: 1.0, 2: 1.0}).replicates == 1
        assert paired_change({1: 2.0}, {2: 1.0}) is None

    def test_nothing_is_divided_by_zero(self):
        assert paired_change({1: 2.0}, {1: 0.0}) is None
        assert paired_change({1: 2.0, 2: 3.0}, {1: 0.0, 2: 2.0}).mean == 0.5

    def test_the_ratio_is_a_median_with_its_range(self):
        ratio = paired_ratio({1: 2.0, 2: 9.0, 3: 1.0}, {1: 1.0, 2: 1.0, 3: 2.0})
        assert (ratio.median, ratio.smallest, ratio.largest) == (2.0, 0.5, 9.0)
        assert paired_ratio({}, {1: 1.0}) is None


class TestObservables:
    """By hand: a run of 4 s with a row each second."""

    SERIES = pd.DataFrame(
        {
            "time_s": [0.0, 1.0, 2.0, 3.0, 4.0],
            "volume_entrance_m3": [0.0, 5.0, 6.0, 7.0, 10.0],
            "volume_middle_m3": [0.0, 0.0, 0.0, 1.0, 2.0],
            "flowing_velocity_m_s": [np.nan, 9.0, 1.0, np.nan, 3.0],
        }
    )
    PATHS = (
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
        [[9.0, 9.0, 9.0], [9.0, 9.0, 9.0]],  # between, of no concern
        [[3.0, 4.0, 0.0], [0.0, 0.0, 0.0]],
    )

    @pytest.fixture
    def found(self, monkeypatch):
        case = case_of(INFILTRATION)
        radii = case.population.particle_radii_m
        mass = 7000.0 * 4.0 / 3.0 * np.pi * np.sum(radii**3)
        # In the second half 1, 2 and 3 m/s; before, speeds that must not count.
        series = self.SERIES.assign(
            kinetic_energy_j=0.5 * mass * np.array([50.0, 40.0, 1.0, 2.0, 3.0]) ** 2
        )
        instants = [SimpleNamespace(positions_m=np.array(path)) for path in self.PATHS]
        monkeypatch.setattr(observables, "iter_instants", lambda run: iter(instants))
        return observe(
            SimpleNamespace(
                series=series,
                case=case,
                directory=None,
                results={"max_overlap_over_radius": 0.004},
            )
        )

    def test_by_hand(self, found):
        expected = {
            "volume_entrance_m3": 10.0,
            "volume_middle_m3": 2.0,
            "flow_rate_entrance_m3_s": (10.0 - 6.0) / 2.0,
            "flow_rate_middle_m3_s": (2.0 - 0.0) / 2.0,
            "flowing_velocity_m_s": (1.0 + 3.0) / 2.0,
            "distance_m": (5.0 + 1.0) / 2.0,
            "distance_x_m": (3.0 - 1.0) / 2.0,
            "rms_speed_m_s": (1.0 + 2.0 + 3.0) / 3.0,
            "largest_overlap_over_radius": 0.004,
        }
        assert found == pytest.approx(expected, rel=ROUNDING)

    def test_each_has_a_title_and_a_unit(self, found):
        assert title_of("volume_entrance_m3") == "volume past the entrance"
        assert title_of("flow_rate_middle_m3_s") == "flow rate, middle"
        assert title_of("distance_x_m") == "distance along x"
        assert {unit_of(name) for name in found} == {"m3", "m3/s", "m/s", "m", "radii"}

    def test_the_main_one(self):
        assert main_observable(scene_of(INFILTRATION)) == "volume_entrance_m3"
        assert main_observable(scene_of(COLLISION)) == "distance_m"


#: How far the particles go in m, and the engine's seconds, with friction and without, by seed.
FAR = {True: {1: 10.0, 2: 20.0}, False: {1: 11.0, 2: 26.0}}
SLOW = {True: {1: 4.0, 2: 8.0}, False: {1: 2.0, 2: 6.0}}


class Engine:
    """In place of the work on a run and of what reads it: answers by hand, for variant and seed."""

    def __init__(self, fail=lambda scene: None) -> None:
        self.fail = fail
        self.runs: list[tuple[bool, float, int, str]] = []
        self.scenes: dict[Path, Scene] = {}

    def work_on(self, task, *_) -> Outcome:
        scene = task.scene()
        rubs = scene.contact.friction > 0
        self.runs.append((rubs, scene.contact.rolling_friction, scene.seed, task.name))
        self.scenes[task.folder] = scene
        reason = self.fail(scene)
        return Outcome("done") if reason is None else Outcome("failed", reason)

    def read(self, folder):
        scene = self.scenes[folder]
        rubs = scene.contact.friction > 0
        results = {
            "verdict": "valid",
            "reasons": [],
            "cost": {"wall_s": SLOW[rubs][scene.seed], "ranks": 1},
            "provenance": {"engine": "by hand"},
        }
        plan = SimpleNamespace(steps=20 if rubs else 10, step_s=0.1 if rubs else 0.2)
        return SimpleNamespace(
            results=results,
            case=SimpleNamespace(time=plan),
            far={"distance_m": FAR[rubs][scene.seed]},
        )


@pytest.fixture
def by_hand(monkeypatch, tmp_path):
    """Study a scene with friction by an engine of that kind."""
    monkeypatch.setattr(measured, "observe", lambda solution: solution.far)

    def study(engine, changes=FRICTION, count=2):
        monkeypatch.setattr("liggghts_driver.sweeps.local.work_on", engine.work_on)
        scene = scene_of(COLLISION, changes)
        case, seeds = whole_case(scene), range(1, count + 1)
        tasks = tasks_in_turn(variants_of(scene), scene, seeds, tmp_path / "runs")
        outcomes = run_tasks(list(tasks.values()), Stop())
        runs = measure(tasks, outcomes, engine.read)
        return write_results(scene, case, runs, tmp_path / "out")

    return study


def variant(results, name):
    (found,) = [one for one in results["variants"] if one["name"] == name]
    return found


class TestStudy:
    def test_every_variant_with_every_seed_interleaved(self, by_hand):
        engine = Engine()
        by_hand(engine)
        once = [
            (True, 0.05, "all effects"),
            (False, 0.0, "without tangential friction"),
            (True, 0.0, "without rolling resistance"),
        ]
        expected = [
            (rubs, mu, seed, f"{name}, seed {seed}") for seed in (1, 2) for rubs, mu, name in once
        ]
        assert engine.runs == expected

    def test_its_numbers(self, by_hand):
        results = by_hand(Engine())
        friction, rolling = (variant(results, f"without-{n}") for n in ("friction", "rolling"))
        (change,) = [item["change"] for item in friction["observables"]]
        # Pairs of 10 and 30 %: mean 20 %; t = 12.706 and an error of the mean of 10 %.
        assert change["mean"] == pytest.approx(0.2, rel=ROUNDING)
        assert change["ci95"] == pytest.approx(12.706 * 0.1, rel=2e-5)
        # Ratios of a half and three quarters.
        assert friction["time_ratio"]["median"] == pytest.approx(0.625, rel=ROUNDING)
        assert friction["time_ratio"]["smallest"] == 0.5
        assert friction["time_ratio"]["largest"] == 0.75
        assert friction["steps_ratio"]["median"] == 0.5
        assert rolling["time_ratio"]["median"] == 1.0
        # 4 and 8 s of the engine for 2 s each.
        assert variant(results, "all-effects")["time_s_per_simulated_s"] == 3.0

    def test_the_estimate_stands_beside(self, by_hand):
        scene = scene_of(COLLISION, FRICTION)
        case = case_of(COLLISION, FRICTION)
        effects = {effect.name: effect for effect in active_effects(scene)}
        friction = variant(by_hand(Engine()), "without-friction")
        estimate = friction["estimate"]
        weight = effects["friction"].weigh(case)
        assert estimate["motion_share"] == weight.share
        assert (estimate["number"], estimate["value"]) == (weight.number, weight.value)
        costs = {name: effect.cost(case) for name, effect in effects.items()}
        gone = costs["friction"] + costs["rolling"] + costs["rotation"]
        assert estimate["time_share"] == pytest.approx(gone / sum(costs.values()), rel=ROUNDING)
        assert friction["left_out"] == ["friction", "rolling", "rotation"]

    def test_the_estimate_is_that_of_the_first_packing(self, by_hand, monkeypatch):
        prepared = []

        def prepare(scene):
            prepared.append(scene.seed)
            return case_of(COLLISION, FRICTION)

        monkeypatch.setattr("liggghts_driver.studies.effects.prepare", prepare)
        by_hand(Engine())
        assert prepared == [1]

    def test_a_failed_run_is_told_and_the_study_goes_on(self, by_hand):
        def fail(scene):
            lost = scene.contact.friction == 0 and scene.seed == 2
            return "lost atoms" if lost else None

        engine = Engine(fail)
        results = by_hand(engine)
        assert len(engine.runs) == 6
        friction = variant(results, "without-friction")
        assert (friction["finished"], friction["failed"]) == (1, 1)
        (change,) = [item["change"] for item in friction["observables"]]
        assert (change["replicates"], change["ci95"]) == (1, None)
        (failed,) = [run for run in results["runs"] if run["failure"]]
        assert failed["failure"] == "lost atoms"
        assert (failed["variant"], failed["seed"]) == ("without-friction", 2)

    def test_without_a_base_nothing_is_compared(self, by_hand, tmp_path):
        results = by_hand(Engine(lambda scene: "no" if scene.contact.friction else None))
        friction = variant(results, "without-friction")
        assert friction["finished"] == 2
        assert friction["time_ratio"] is None
        assert friction["observables"][0]["change"] is None
        assert (tmp_path / "out" / "effects.png").exists()

    def test_a_run_that_cannot_be_read_is_a_failed_run(self, by_hand):
        class Spoilt(Engine):
            def read(self, folder):
                if self.scenes[folder].contact.friction == 0:
                    raise ParseError("series.txt: cut off")
                return super().read(folder)

        results = by_hand(Spoilt(), count=1)
        assert variant(results, "without-friction")["failed"] == 1
        assert [run["failure"] for run in results["runs"]] == [None, "series.txt: cut off", None]

    def test_processor_time_counts_where_it_is_known(self, by_hand):
        class Told(Engine):
            def read(self, folder):
                solution = super().read(folder)
                solution.results["cost"] |= {"cpu_s": 3.0}
                return solution

        whole = by_hand(Told(), count=1)["runs"][0]
        assert whole["wall_s"] == 4.0
        assert whole["time_s_per_simulated_s"] == 1.5  # of 2 s

    def test_a_whole_scene_that_cannot_be_is_refused_before_anything_runs(self, by_hand, tmp_path):
        engine = Engine()
        with pytest.raises(SceneError, match=r"time\.step"):
            by_hand(engine, {**FRICTION, "time.step": 0.05})
        assert engine.runs == []
        assert not (tmp_path / "out").exists()

    def test_one_replicate_is_called_so(self, by_hand):
        results = by_hand(Engine(), count=1)
        assert any("one replicate" in note for note in results["notes"])
        assert not any("one replicate" in note for note in by_hand(Engine(), count=2)["notes"])

    def test_its_files(self, by_hand, tmp_path):
        results = by_hand(Engine())
        out = tmp_path / "out"
        assert json.loads((out / "effects.json").read_text()) == results
        table = pd.read_csv(out / "effects.csv").set_index("variant")
        assert list(table.index) == ["all-effects", "without-friction", "without-rolling"]
        row = table.loc["without-friction"]
        assert row["left_out"] == "friction rolling rotation"
        assert row["distance_m"] == 18.5
        assert row["relative_change_of_distance_m"] == pytest.approx(0.2, rel=ROUNDING)
        assert row["relative_change_ci95_of_distance_m"] == pytest.approx(1.2706, rel=2e-5)
        assert row["time_ratio_median"] == pytest.approx(0.625, rel=ROUNDING)
        assert table["relative_change_of_distance_m"].isna().tolist() == [True, False, False]
        assert results["seeds"] == [1, 2]
        assert results["provenance"]["scene_sha256"] == scene_hash(scene_of(COLLISION, FRICTION))


class TestFigure:
    def painted(self, results):
        figure = Figure()
        rows = [one for one in results["variants"] if one["left_out"]]
        paint_effects(rows, results["main_observable"], figure)
        return figure.axes

    def test_it_shows_the_numbers(self, by_hand):
        times, changes = self.painted(by_hand(Engine()))
        assert [bar.get_width() for bar in times.patches] == pytest.approx([0.625, 1.0])
        words = [text.get_text() for text in times.texts]
        assert words == [
            "without\ntangential friction",
            "0.625 (0.500 to 0.750)",
            "without\nrolling resistance",
            "1.00 (1.00 to 1.00)",
        ]
        assert [text.get_text() for text in changes.texts] == ["20 ± 127 %", "0 %"]
        points = [line.get_xdata()[0] for line in changes.lines if line.get_marker() == "o"]
        assert points == pytest.approx([20.0, 0.0])
        # The interval as it is drawn, 127.06 % to each side.
        (low, high), _ = [part.get_segments()[0][:, 0] for part in changes.collections]
        assert (high - low) / 2.0 == pytest.approx(127.06, rel=2e-5)
        assert changes.get_xlabel() == "change of distance\ntravelled [%]"

    def test_what_is_not_known_is_said(self, by_hand):
        results = by_hand(Engine(lambda s: None if s.contact.friction else "no"), count=1)
        times, changes = self.painted(results)
        assert "no finished run" in [text.get_text() for text in times.texts]
        assert [text.get_text() for text in changes.texts] == ["not known", "0 %"]

    def test_equal_data_give_equal_files(self, by_hand):
        results = by_hand(Engine())
        assert draw_effects(results) == draw_effects(results)


@pytest.fixture
def cli(monkeypatch, capsys, tmp_path):
    """Run ``study effects`` in a folder of its own on a scene with friction; code, out, err."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    (tmp_path / "scene.json").write_text(json.dumps(changed(COLLISION, RUBBING)))

    def run(*arguments: str, scene: str = "scene.json"):
        words = ["liggghts-driver", "study", "effects", scene, *arguments]
        monkeypatch.setattr(sys, "argv", words)
        capsys.readouterr()
        code = 0
        try:
            main()
        except SystemExit as ended:
            code = ended.code or 0
        return code, *capsys.readouterr()

    return run


def run_of(scene: Scene) -> str:
    """Name of the run of a scene."""
    return scene_hash(scene)[:16]


class TestCommand:
    def test_tables_of_80_columns(self, cli, engine, tmp_path):
        code, out, err = cli("--out", "made", "--replicates", "2")
        assert (code, err) == (0, "")
        text = " ".join(out.split())
        assert "tangential friction," in text
        assert "and with it rotation" in text
        assert "friction angle" in text
        assert "distance travelled" in text
        # Of the tables; reasons and paths below them are lines as long as they are.
        assert max(map(len, out.split("note:")[0].split("invalid:")[0].splitlines())) <= 80
        assert (tmp_path / "made" / "effects.png").read_bytes().startswith(b"\x89PNG")

    def test_json_is_one_document(self, cli, engine):
        code, out, err = cli("--out", "made", "--replicates", "1", "--json")
        document = json.loads(out)
        assert (code, err) == (0, "")
        assert document["variants"][0]["name"] == "all-effects"
        assert document["provenance"]["command"][1:3] == ["study", "effects"]
        assert document["folder"] == "made"

    def test_its_runs_are_where_those_of_sweeps_are_each_with_its_report(
        self, cli, engine, tmp_path
    ):
        runs = json.loads(cli("--replicates", "2", "--json")[1])["runs"]
        scenes = [
            scene_of(COLLISION, {"contact.friction": mu, "seed": seed})
            for seed in (1, 2)
            for mu in (0.3, 0.0)
        ]
        assert [run["folder"] for run in runs] == [f"runs/points/{run_of(s)}" for s in scenes]
        for run, scene in zip(runs, scenes, strict=True):
            directory = RunDirectory(tmp_path / run["folder"])
            assert directory.read_scene() == scene
            assert directory.report.exists()

    def test_it_finds_what_a_sweep_has_done(self, cli, engine, tmp_path, monkeypatch):
        (tmp_path / "sweep.toml").write_text(
            'scene = "scene.json"\n[[axes]]\nkey = "contact.friction"\nvalues = [0.3, 0.0]\n'
        )
        words = ["liggghts-driver", "sweep", "run", "sweep.toml", "--runs", "ours"]
        monkeypatch.setattr(sys, "argv", words)
        with pytest.raises(SystemExit) as ended:
            main()
        assert not ended.value.code
        options = ("--runs", "ours", "--replicates", "2", "--json")
        runs = json.loads(cli(*options)[1])["runs"]
        assert [run["reused"] for run in runs] == [True] * 2 + [False] * 2
        assert not (tmp_path / "runs" / "points").exists()

    def test_a_study_is_resumed_and_extended(self, cli, engine):
        first = json.loads(cli("--out", "made", "--replicates", "1", "--json")[1])
        assert not any(run["reused"] for run in first["runs"])
        second = json.loads(cli("--out", "made", "--replicates", "2", "--json")[1])
        assert [run["reused"] for run in second["runs"]] == [True] * 2 + [False] * 2
        assert second["runs"][0]["wall_s"] == first["runs"][0]["wall_s"]

    def test_failed_runs_are_in_the_tables_and_tried_again(self, cli, engine):
        engine("crash")
        code, out, err = cli("--out", "made", "--replicates", "1")
        assert code == 1
        told = "the engine ended with return code"
        names = ("all effects, seed 1", "without tangential friction, seed 1")
        for line, name in zip(err.splitlines(), names, strict=True):
            assert line.startswith(f"failed: {name}: {told}")
        assert f"failed: all effects, 1 of 1 runs; seed 1: {told}" in out
        assert "not known" in out
        assert cli("--out", "made", "--replicates", "1")[0] == 1
        engine("")
        assert cli("--out", "made", "--replicates", "1")[0] == 0

    def test_a_variant_that_cannot_be_is_a_failed_run(self, cli, engine, tmp_path):
        """A step that is asked for can be too long for a scene without drag: all falls faster."""
        thick = {"fluid": {**FLUID, "viscosity": 1.0}, "gravity": GRAVITY}
        # At most 7.8e-5 s with drag, 4.1e-5 s without.
        tables = changed(COLLISION, {**thick, "gravity.buoyancy": False, "time.step": 6e-5})
        (tmp_path / "dragged.json").write_text(json.dumps(tables))
        code, out, err = cli("--replicates", "1", "--json", scene="dragged.json")
        assert code == 1
        assert err.startswith("failed: without fluid drag, seed 1: time.step = 6e-05 s: must be")
        runs = {run["variant"]: run["failure"] for run in json.loads(out)["runs"]}
        assert runs["without-drag"].startswith("time.step = 6e-05 s: must be")
        assert runs["all-effects"] is runs["without-gravity"] is None

    def test_no_effect_to_leave_out(self, cli, engine, tmp_path):
        (tmp_path / "bare.json").write_text(json.dumps(COLLISION))
        code, out, _ = cli("--replicates", "1", "--out", "made", scene="bare.json")
        assert code == 0
        assert "no effect of this scene can be left out" in out
        assert "all effects" in out
        assert not (tmp_path / "made" / "effects.png").exists()
        assert len(pd.read_csv(tmp_path / "made" / "effects.csv")) == 1

    def test_the_folder_is_named_after_the_scene(self, cli, engine, tmp_path):
        cli("--replicates", "1", "--json")
        name = f"study-effects-scene-{scene_hash(scene_of(COLLISION, RUBBING))[:8]}"
        assert {path.name for path in (tmp_path / "runs").iterdir()} == {"points", name}

    def test_a_folder_with_something_else_is_left_alone(self, cli, engine, tmp_path):
        strange = tmp_path / "runs" / "points" / run_of(scene_of(COLLISION, RUBBING))
        strange.mkdir(parents=True)
        (strange / "thesis.txt").write_text("all I have")
        code, out, err = cli("--replicates", "1", "--json")
        assert code == 1
        assert f"{strange.name}: holds files but no run" in err
        first, second = json.loads(out)["runs"]
        assert "holds files but no run" in first["failure"]
        assert second["failure"] is None
        assert [path.name for path in strange.iterdir()] == ["thesis.txt"]
        assert (strange / "thesis.txt").read_text() == "all I have"

    def test_without_an_engine_nothing_is_tried_but_what_is_done_is_shown(
        self, cli, engine, tmp_path, monkeypatch
    ):
        with monkeypatch.context() as patch:
            patch.setenv("LIGGGHTS_DRIVER_BINARY", "/no/such/engine")
            code, out, _ = cli("--replicates", "1", "--json")
        assert code == 1
        assert json.loads(out)["error"] == "EngineNotFoundError"
        assert not (tmp_path / "runs").exists()
        assert cli("--replicates", "1", "--json")[0] == 0
        monkeypatch.setenv("LIGGGHTS_DRIVER_BINARY", "/no/such/engine")
        assert cli("--replicates", "1", "--json")[0] == 0

    def test_a_bad_scene_ends_with_2(self, cli, engine, tmp_path):
        code, out, _ = cli("--set", "time.duration=-1", "--json")
        assert code == 2
        assert json.loads(out)["error"] == "SceneError"
        assert not (tmp_path / "runs").exists()

    def test_a_scene_that_cannot_be_run_ends_with_2_before_anything_runs(
        self, cli, engine, tmp_path
    ):
        code, out, _ = cli("--set", "time.step=0.05", "--json")
        assert code == 2
        assert "time.step" in json.loads(out)["message"]
        assert not (tmp_path / "runs").exists()


@pytest.fixture
def command(binary, tmp_path):
    """Start the command as a process of its own, with a behaviour of the engine."""
    started = []

    def start(behaviour: str, *options: str):
        words = ["study", "effects", "scene.json", "--out", "made", *options]
        process = subprocess.Popen(
            [sys.executable, "-m", "liggghts_driver", *words],
            cwd=tmp_path,
            env={**os.environ, "LIGGGHTS_DRIVER_BINARY": str(binary), "FAKE_ENGINE": behaviour},
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        return process

    yield start
    for process in started:
        process.kill()
        process.communicate(timeout=10)


#: More than a command needs to start on a machine that is full of other work.
PATIENCE_S = 60.0


def wait_for(condition) -> None:
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end, "waited too long"
        time.sleep(0.02)


class TestInterrupts:
    def test_one_ends_it_at_a_checkpoint_and_the_same_command_goes_on(
        self, cli, engine, command, tmp_path
    ):
        process = command("slow", "--replicates", "1")
        run = RunDirectory(tmp_path / "runs" / "points" / run_of(scene_of(COLLISION, RUBBING)))
        wait_for(lambda: run.log.exists() and "Loop time" in run.log.read_text())
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE_S)
        assert process.returncode == 130
        assert err == "interrupted; the same command goes on from there\n"
        assert not (tmp_path / "made").exists()
        assert run.read_state()["state"] == "interrupted"
        assert [path.name for path in run.path.parent.iterdir()] == [run.path.name]
        code, out, _ = cli("--out", "made", "--replicates", "1", "--json")
        assert code == 0
        assert [run["reused"] for run in json.loads(out)["runs"]] == [False, False]
        assert run.read_state()["continuations"] == 1

    def test_two_end_it_at_once(self, cli, engine, command, tmp_path):
        cli("--out", "made", "--replicates", "1")
        process = command("hang", "--replicates", "2")
        scene = scene_of(COLLISION, {**RUBBING, "seed": 2})
        run = RunDirectory(tmp_path / "runs" / "points" / run_of(scene))
        wait_for((run.path / "pids").exists)
        process.send_signal(signal.SIGINT)  # it hangs and will make no checkpoint
        wait_for(lambda: run.control.read_text() == run.checkpoint_commands.read_text())
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=15)
        assert process.returncode == 130
        assert err == "interrupted; the same command goes on from there\n"
        runs = json.loads(cli("--out", "made", "--replicates", "2", "--json")[1])["runs"]
        assert [run["reused"] for run in runs] == [True] * 2 + [False] * 2
