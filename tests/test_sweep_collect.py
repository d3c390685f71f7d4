from __future__ import annotations

import importlib.util
import json
import re
from dataclasses import dataclass, field
from html.parser import HTMLParser
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

import pandas as pd
import pytest
from small_scenes import COLLISION, INFILTRATION, scene_of

from liggghts_driver.effects import EFFECTS
from liggghts_driver.errors import RunFolderError
from liggghts_driver.prediction import predict
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.scene.model import Scene, table_class
from liggghts_driver.sweeps import page
from liggghts_driver.sweeps.collect import collect
from liggghts_driver.sweeps.table import axis_column, points_table

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

GRADIENT = "pressure.gradient"


@dataclass(frozen=True)
class Point:
    """A point as the plan of a sweep has it."""

    index: int
    run: str
    values: Mapping[str, Any]
    replicate: int = 0
    seed: int = 1
    ranks: int = 1


@dataclass(frozen=True)
class Plan:
    """A plan with what is asked of one here."""

    axes: tuple[str, ...]
    points: tuple[Point, ...]
    base: Mapping[str, Any] = field(default_factory=lambda: INFILTRATION)
    title: str = "A sweep <made up>"
    source: str = "made_up.toml"

    def scene(self, point: Point) -> Scene:
        return scene_of(self.base, {**point.values, "seed": point.seed})  # noqa: PD011


def plan_of(
    axes: Iterable[str],
    rows: Iterable[tuple[Any, ...]],
    replicates: int = 1,
    base: Mapping[str, Any] = INFILTRATION,
) -> Plan:
    """All rows of values for replicate 0, then for the next."""
    axes, rows = tuple(axes), list(rows)
    places = [(row, number) for number in range(replicates) for row in rows]
    points = [
        Point(n, f"{n:016x}", dict(zip(axes, row, strict=True)), number, 1 + number)
        for n, (row, number) in enumerate(places)
    ]
    return Plan(axes, tuple(points), base)


def finish(plan: Plan, point: Point, runs: Path, factor: float, **changes: Any) -> dict[str, Any]:
    """Write what a finished run leaves, with flow rates that are ``factor`` times the estimate."""
    run = RunDirectory(runs / point.run)
    run.path.mkdir(parents=True)
    estimate = {"applies": True, **predict(plan.scene(point)).as_dict()}
    flow, pore = estimate["particle_flow_rate_m3_s"], estimate["pore_velocity_m_s"]
    means = {"entrance": factor * flow, "middle": 0.8 * factor * flow}
    results = {
        "verdict": "valid",
        "reasons": [],
        "sections": {
            name: {"x_m": 0.0, "particle_flow_rate_m3_s": part(mean, 0.04 * flow)}
            for name, mean in means.items()
        },
        "flowing_velocity_m_s": part(0.9 * factor * pore, 0.05 * pore),
        "estimate": estimate,
        "comparison": {
            **{name: pair(mean, 0.04 * flow, flow) for name, mean in means.items()},
            "flowing_velocity": pair(0.9 * factor * pore, 0.05 * pore, pore),
        },
        "exact": [],
        "time_step_s": 1e-4,
        "max_overlap_over_radius": 1e-3,
        "cost": {"wall_s": 12.5, "steps": 10_000, "ranks": 2, "particle_steps_per_s": 1e6},
        "provenance": {"liggghts_driver": "0.1.0", "engine": "LIGGGHTS-PUBLIC 3.8.0"},
        **changes,
    }
    run.results.write_text(json.dumps(results), encoding="utf-8")
    run.write_state(state="complete", failures=1, continuations=2)
    rows = [f"{n},{n / 2},{n * flow / 2!r},{n * flow / 4!r},{''}" for n in range(3)]
    head = "step,time_s,volume_entrance_m3,volume_middle_m3,flowing_velocity_m_s"
    run.series.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    return results


def part(mean: float | None, ci95: float | None, *, steady: bool = True) -> dict[str, Any]:
    return {"mean": mean, "ci95": ci95, "steady": steady}


def pair(simulated: float, ci95: float, estimated: float) -> dict[str, float]:
    z_score = 1.96 * (simulated - estimated) / ci95
    return {"estimated": estimated, "ratio": simulated / estimated, "z_score": z_score}


def fail(point: Point, runs: Path, state: str = "failed", **facts: Any) -> None:
    """Write what a run leaves that gave no answer."""
    run = RunDirectory(runs / point.run)
    run.path.mkdir(parents=True)
    run.write_state(state=state, **facts)


GRADIENTS = [(1.0,), (10.0,), (100.0,)]


def csv(path: Path, like: pd.DataFrame) -> pd.DataFrame:
    """A table as it was written; types are not in it."""
    return pd.read_csv(path, dtype=like.dtypes.to_dict())


class Page(HTMLParser):
    """A page as a browser takes it: its text, its links, the cells of its tables by row."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.text, self.links, self.images = "", [], 0
        self.rows: list[list[str]] = []
        self._open: list[str] = []
        self.feed(html)
        self.close()
        assert not self._open, "elements that are never closed"

    def handle_starttag(self, tag, attrs):
        if tag in {"meta", "img"}:
            self.images += tag == "img"
            return
        self._open.append(tag)
        self.links += [value for name, value in attrs if name == "href"]
        if tag == "tr":
            self.rows.append([])
        if tag in {"td", "th"}:
            self.rows[-1].append("")

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, data):
        if "style" not in self._open:
            self.text += data
        if {"td", "th"} & set(self._open):
            self.rows[-1][-1] += data


def read_page(path: Path) -> Page:
    return Page(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("key", "column"),
    [
        ("pressure.gradient", "pressure_gradient_pa_m"),
        ("fluid.viscosity", "fluid_viscosity_pa_s"),
        ("particles.volume_fraction", "particles_volume_fraction"),
        ("specimen.exit", "specimen_exit"),
        ("spheres[0].radius", "spheres_0_radius_m"),
        ("gravity.acceleration", "gravity_acceleration_m_s2"),
        ("seed", "seed"),
        ("specimen", "specimen"),
    ],
)
def test_the_column_of_an_axis_ends_with_the_unit_of_its_key(key, column):
    assert axis_column(key) == column


def test_the_numbers_of_an_effect_have_their_units_too():
    units = {f"{e.name}.{name}": s.unit for e in EFFECTS for name, s in e.settings.items()}
    for name, unit in units.items():
        end = f"_{unit.lower().replace('/', '_').replace(' ', '_')}" if unit else ""
        column = axis_column(f"effects.settings.{name}")
        assert column == f"effects_settings_{name.replace('.', '_')}{end}"


def test_an_unknown_key_has_no_column():
    with pytest.raises(KeyError):
        axis_column("pressure.grad")


def test_no_axis_is_called_like_another_column(tmp_path):
    """Save the seed, which is that of the point."""
    plan = plan_of([], [()])
    finish(plan, plan.points[0], tmp_path, 1.0)
    taken = set(points_table(plan, tmp_path)) - {"seed"}
    keys = []
    for name, info in Scene.model_fields.items():
        table = table_class(info.annotation)
        keys += [f"{name}.{key}" for key in table.model_fields] if table else [name]
    assert len(keys) > 60  # every table was gone through
    assert not {axis_column(key) for key in keys} & taken


def test_a_row_holds_what_the_run_says(tmp_path):
    plan = plan_of([GRADIENT, "specimen.exit"], [(10.0, "open")])
    results = finish(plan, plan.points[0], tmp_path, 0.5, reasons=["a", "b"])
    row = points_table(plan, tmp_path).iloc[0]
    middle = results["sections"]["middle"]["particle_flow_rate_m3_s"]
    flow = results["estimate"]["particle_flow_rate_m3_s"]
    expected = {
        "point": 0,
        "run": plan.points[0].run,
        "seed": 1,
        "pressure_gradient_pa_m": 10.0,
        "specimen_exit": "open",
        "state": "done",
        "verdict": "valid",
        "reasons": "a; b",
        "flow_rate_middle_m3_s": middle["mean"],
        "flow_rate_middle_ci95_m3_s": middle["ci95"],
        "flow_rate_middle_steady": True,
        "ratio_middle": results["comparison"]["middle"]["ratio"],
        "ratio_middle_ci95": middle["ci95"] / flow,
        "z_score_middle": results["comparison"]["middle"]["z_score"],
        "volume_end_middle_m3": flow / 2,  # of the last row of the series
        "estimate_flow_rate_m3_s": flow,
        "estimate_flowing_velocity_m_s": results["estimate"]["pore_velocity_m_s"],
        "flowing_velocity_ci95_m_s": results["flowing_velocity_m_s"]["ci95"],
        "step_s": 1e-4,
        "steps": 10_000,
        "wall_s": 12.5,
        "core_s": 25.0,  # on two ranks
        "failures": 1,
        "continuations": 2,
    }
    assert {name: row[name] for name in expected} == expected
    assert pd.isna(row["reason"])


def test_points_without_an_answer_are_rows_with_their_reasons(tmp_path):
    plan = plan_of([GRADIENT], [(float(n),) for n in range(1, 9)])
    states = iter(plan.points)
    fail(next(states), tmp_path, faults=["the engine\n  stopped", "more"], failures=3, wall_s=4.0)
    fail(next(states), tmp_path)
    fail(next(states), tmp_path, "interrupted")
    fail(next(states), tmp_path, "running", continuations=1)
    fail(next(states), tmp_path, "complete")
    unreadable, cut = next(states), next(states)
    for point in (unreadable, cut):
        (tmp_path / point.run).mkdir()
    (tmp_path / unreadable.run / "run.json").write_text("{", encoding="utf-8")
    (tmp_path / cut.run / "results.json").write_text("{", encoding="utf-8")
    table = points_table(plan, tmp_path)
    assert table["state"].tolist() == [
        *("failed", "failed", "interrupted", "running"),
        *("interrupted", "failed", "failed", "waiting"),
    ]
    reasons = table["reason"].fillna("").tolist()
    assert reasons[:4] == ["the engine stopped", "no reason was recorded", "", ""]
    assert "no answer yet" in reasons[4]
    assert reasons[5] == "run.json cannot be read"
    assert reasons[6].startswith("results.json cannot be read")
    assert table["failures"].tolist() == [3, 0, 0, 0, 0, 0, 0, 0]
    assert table["continuations"].sum() == 1
    assert table["wall_s"].iloc[0] == 4.0
    assert table["flow_rate_entrance_m3_s"].isna().all()


def test_types_are_the_same_whether_all_failed_or_none(tmp_path):
    plan = plan_of([GRADIENT, "specimen.exit"], [(1.0, "open"), (2.0, "closed")])
    for point in plan.points:
        finish(plan, point, tmp_path / "good", 1.0)
        fail(point, tmp_path / "bad")
    tables = [points_table(plan, tmp_path / name) for name in ("good", "bad", "nothing")]
    for table in tables[1:]:
        pd.testing.assert_series_equal(table.dtypes, tables[0].dtypes)


@pytest.mark.parametrize(
    ("key", "values", "kind"),
    [
        ("pressure.gradient", [1.0, 2], "float64"),
        ("particles.count", [20, 30], "int64"),
        ("output.paraview", [True, False], "bool"),
        ("specimen.exit", ["open", "closed"], "string"),
        ("gravity.acceleration", [[0.0, 0.0, -1.0], [0.0, 0.0, -2.0]], "string"),
    ],
)
def test_values_of_an_axis_keep_their_kind(key, values, kind, tmp_path):
    plan = plan_of([key], [(value,) for value in values], base={**INFILTRATION, "gravity": {}})
    column = points_table(plan, tmp_path)[axis_column(key)]
    assert str(column.dtype) == kind
    told = [json.loads(v) for v in column] if isinstance(values[0], list) else column.tolist()
    assert told == values


def test_a_run_in_which_nothing_flows_has_no_velocity(tmp_path):
    plan = plan_of([], [()])
    nothing = {"flowing_velocity_m_s": part(None, None, steady=False), "comparison": {}}
    finish(plan, plan.points[0], tmp_path, 1.0, **nothing)
    row = points_table(plan, tmp_path).iloc[0]
    assert row[["flowing_velocity_m_s", "ratio_entrance", "z_score_entrance"]].isna().all()
    assert not row["flowing_velocity_steady"]


def test_exact_answers_are_columns_of_a_scene_without_a_specimen(tmp_path):
    plan = plan_of(["contact.damping_ratio"], [(0.1,), (0.2,)], base=COLLISION)
    run = RunDirectory(tmp_path / plan.points[0].run)
    run.path.mkdir()
    results = {
        "verdict": "valid",
        "reasons": [],
        "sections": {},
        "flowing_velocity_m_s": {},
        "estimate": {"applies": False, "reason": "none"},
        "comparison": {},
        "exact": [{"name": "restitution", "simulated": 0.71, "exact": 0.7, "ratio": 1.01}],
        "time_step_s": 1e-5,
        "max_overlap_over_radius": 0.001,
        "cost": {"wall_s": 1.0, "steps": 10, "ranks": 1, "particle_steps_per_s": 1.0},
        "provenance": {"liggghts_driver": "0.1.0", "engine": "e"},
    }
    run.results.write_text(json.dumps(results), encoding="utf-8")
    found = collect(plan, tmp_path / "out", tmp_path)
    assert found.points["restitution"].tolist()[0] == 0.71
    assert found.pooled["exact_restitution"].tolist()[0] == 0.7
    assert found.pooled["ratio_restitution"].tolist()[0] == pytest.approx(0.71 / 0.7)
    assert [f.stem for f in found.files if f.suffix == ".png"] == ["restitution"]
    assert "flow_rate_entrance_m3_s" not in found.points


@pytest.fixture
def mixed(tmp_path):
    """A sweep of which some points failed, one runs and one waits; two of its reports are there."""
    plan = plan_of([GRADIENT], GRADIENTS, replicates=3)
    runs = tmp_path / "runs" / "points"
    for point in plan.points[:5]:
        finish(plan, point, runs, 0.9 + 0.01 * point.index)
    for point in plan.points[:2]:
        (runs / point.run / "report.html").write_text("report", encoding="utf-8")
    fail(plan.points[5], runs, faults=["Atom lost: 1 < 2"])
    fail(plan.points[6], runs, faults=["Atom lost: 1 < 2"])
    fail(plan.points[7], runs, "running")
    return plan, tmp_path / "runs" / "sweep a b", runs


def test_csv_and_parquet_hold_what_is_returned(mixed):
    pytest.importorskip("pyarrow")
    found = collect(*mixed)
    for name, table in (("results", found.points), ("pooled", found.pooled)):
        stored = pd.read_parquet(mixed[1] / f"{name}.parquet").astype(table.dtypes.to_dict())
        pd.testing.assert_frame_equal(stored, table)
        # Numbers are written in full; pandas before 3.1 reads them to the last bit but one.
        pd.testing.assert_frame_equal(csv(mixed[1] / f"{name}.csv", table), table, rtol=1e-15)
    assert len(found.points) == 9  # failed and waiting points too
    assert found.pooled["failed"].tolist() == [1, 0, 1]


def test_without_pyarrow_there_is_a_note_and_no_parquet(mixed, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda _name: None)
    found = collect(*mixed)
    assert any("pip install pyarrow" in note for note in found.notes)
    assert not list(mixed[1].glob("*.parquet"))
    assert "pip install pyarrow" in read_page(found.page).text


def test_all_files_are_named_and_there(mixed):
    found = collect(*mixed)
    there = {path for path in mixed[1].rglob("*") if path.is_file()}
    assert set(found.files) == there
    assert {path.name for path in there} >= {"results.csv", "pooled.csv", "sweep.html"}
    assert {path.name for path in there if path.suffix == ".png"} == {
        "flow_rate.png",
        "flowing_velocity.png",
    }


def test_the_links_of_the_page_resolve_and_lead_to_the_reports(mixed):
    plan, folder, runs = mixed
    links = read_page(collect(plan, folder, runs).page).links
    assert [(folder / unquote(link)).resolve() for link in links] == [
        (runs / point.run / "report.html").resolve() for point in plan.points[:2]
    ]
    assert not any(link.startswith("/") for link in links)
    assert all((folder / unquote(link)).is_file() for link in links)


def test_the_page_shows_counts_combinations_and_every_point(mixed):
    plan = mixed[0]
    shown = read_page(collect(*mixed, command=["liggghts-driver", "sweep", "a b"]).page)
    assert "5 of 9 points done" in shown.text
    assert "5 valid" in shown.text
    assert "1 running, 1 waiting, 2 failed" in shown.text
    assert "A sweep <made up>" in shown.text  # escaped in the file
    assert "liggghts-driver sweep 'a b'" in shown.text
    assert shown.images == 2
    assert len(shown.rows) == (1 + 3) + (1 + 9)
    one, ten, hundred = (row[:2] for row in shown.rows[1:4])
    assert [one[0], ten[0], hundred[0]] == ["1", "10", "100"]
    assert " ".join(one[1].split()) == "2 valid, 1 failed"
    assert " ".join(hundred[1].split()) == "1 valid, 1 failed, 1 unfinished"
    points = shown.rows[5:]
    assert [row[1] for row in points] == [point.run for point in plan.points]
    assert points[5][-3:] == ["failed", "", "Atom lost: 1 < 2"]
    assert points[0][-3:] == ["done", "valid", ""]


def test_numbers_of_the_page_are_those_of_the_tables(mixed):
    found = collect(*mixed)
    html = found.page.read_text(encoding="utf-8")
    shown = [float(value) for value in re.findall(r'<data value="([^"]+)">', html)]
    names = ["flow_rate_entrance_m3_s", "flow_rate_middle_m3_s", "flowing_velocity_m_s"]
    assert shown == found.pooled[names].to_numpy().ravel().tolist()
    assert not re.search(r"\b(None|nan|inf|NA)\b", re.sub(r"base64,[^\"]*", "", html))


def test_reports_that_finished_runs_lack_are_written_and_linked(mixed):
    plan, folder, runs = mixed
    asked = []

    def write(run):
        asked.append(run)
        if run.name == plan.points[3].run:
            raise RunFolderError("its deck is another's")
        (run / "report.html").write_text("late", encoding="utf-8")

    found = collect(plan, folder, runs, write_report_of=write)
    assert asked == [runs / point.run for point in plan.points[2:5]]
    assert len(read_page(found.page).links) == 4
    (note,) = found.notes
    assert plan.points[3].run in note
    assert "its deck is another's" in note


def test_a_plan_without_axes_is_one_combination(tmp_path):
    plan = plan_of([], [()], replicates=4)
    for point in plan.points:
        finish(plan, point, tmp_path / "runs", 1.0 + 0.1 * point.replicate)
    found = collect(plan, tmp_path / "out", tmp_path / "runs")
    assert found.pooled["replicates"].tolist() == [4]
    assert found.pooled["ratio_entrance"].iloc[0] == pytest.approx(1.15)
    assert len(read_page(found.page).rows) == (1 + 1) + (1 + 4)


def test_a_sweep_of_which_all_failed_is_told_in_full(tmp_path):
    plan = plan_of([GRADIENT, "specimen.phi"], [(1.0, 0.5), (2.0, 0.5), (1.0, 1.0), (2.0, 1.0)])
    for point in plan.points:
        fail(point, tmp_path / "runs", faults=["no"])
    found = collect(plan, tmp_path / "out", tmp_path / "runs")
    assert found.points["state"].tolist() == ["failed"] * 4
    assert found.pooled["failed"].tolist() == [1] * 4
    shown = read_page(found.page)
    assert "0 of 4 points done" in shown.text
    assert "4 failed" in shown.text
    assert shown.images == 0
    assert not shown.links


@pytest.mark.parametrize(("most", "listed"), [(3, 3), (2, 2), (9, 9)])
def test_a_long_table_of_points_is_left_to_the_csv_save_what_failed(
    mixed, monkeypatch, most, listed
):
    """9 points of which 2 failed, and 3 combinations."""
    monkeypatch.setattr(page, "MOST_ROWS", most)
    shown = read_page(collect(*mixed).page)
    points = [row for row in shown.rows if len(row) > 2 and re.fullmatch("[0-9a-f]{16}", row[1])]
    states = [row[-3] for row in points]
    if most >= 9:
        assert len(points) == listed
        assert "results.csv" not in shown.text
        return
    assert states == ["failed"] * 2
    assert "results.csv" in shown.text
    assert "the 2 that failed" in " ".join(shown.text.split())
    assert ("more combinations stand in pooled.csv" in shown.text) == (most < 3)


def test_more_failures_than_rows_are_counted(mixed, monkeypatch):
    monkeypatch.setattr(page, "MOST_ROWS", 1)
    text = " ".join(read_page(collect(*mixed).page).text.split())
    assert "the first 1 of 2 that failed" in text


def test_collecting_again_gives_the_same_files(mixed):
    first = collect(*mixed)
    bytes_of = {f: f.read_bytes() for f in first.files if f.suffix in {".csv", ".png"}}
    again = collect(*mixed)
    assert {f: f.read_bytes() for f in again.files if f in bytes_of} == bytes_of
