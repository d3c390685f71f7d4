from __future__ import annotations

import io
import itertools

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle
from PIL import Image
from test_sweep_collect import GRADIENT, fail, finish, plan_of

from liggghts_driver.prediction import predict
from liggghts_driver.report.numbers import Unit
from liggghts_driver.sweeps import collect as collecting
from liggghts_driver.sweeps.collect import draw_figures
from liggghts_driver.sweeps.figures import (
    Curve,
    Panel,
    Scale,
    Series,
    paint_effects,
    paint_map,
    paint_series,
)
from liggghts_driver.sweeps.page import axis_scale, result_scale, shown_unit
from liggghts_driver.sweeps.pooling import pool, theory_of
from liggghts_driver.sweeps.table import axis_column, points_table, results_in

PHI = "specimen.phi"
PLAIN = Unit("", 1.0)
#: Figures are drawn in doubles: what is left is rounding.
EXACT = {"rtol": 1e-12}


def numbers(*values):
    return pd.Series(values, dtype="float64")


def labels_of(figure):
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


class Caught:
    """What was painted, each figure by the name of its painter, in the order of the pictures."""

    def __init__(self, monkeypatch):
        self.figures = []

        def draw(paint, height_in):
            figure = Figure(figsize=(5.6, height_in), layout="constrained")
            paint(figure)
            self.figures.append((paint.func.__name__, figure))
            return b"a PNG"

        monkeypatch.setattr(collecting, "draw", draw)


@pytest.fixture
def caught(monkeypatch):
    return Caught(monkeypatch)


def sweep(folder, axes, rows, replicates=1, bad=(), **changes):
    """Points, combinations and pictures of a made-up sweep."""
    plan = plan_of(axes, rows, replicates)
    for point in plan.points:
        if point.index in bad:
            fail(point, folder)
        else:
            finish(plan, point, folder, 0.9 + 0.05 * point.replicate, **changes)
    points = points_table(plan, folder)
    pooled = pool(points, plan.axes)
    return plan, pooled, draw_figures(points, pooled, plan.axes, theory_of(plan))


@pytest.mark.parametrize(
    ("values", "log"),
    [
        ([1, 10, 100], True),
        ([1, 2, 5, 10, 20, 50], True),
        ([1, 2, 4, 8, 16], True),
        ([1, 2, 3, 4, 5, 6, 7, 8, 9, 10], False),
        ([10, 20, 40], False),  # too narrow to need it
        ([0, 1, 10, 100], False),
        ([-1, 10, 100], False),
        ([1, 100], False),  # nothing tells how two are spaced
        ([5], False),
    ],
)
def test_an_axis_is_logarithmic_where_its_values_are_spaced_so(values, log):
    assert axis_scale(GRADIENT, pd.Series(values)).log is log


@pytest.mark.parametrize(
    ("unit", "largest", "shown", "size"),
    [
        ("Pa/m", 100.0, "Pa/m", 1.0),
        ("Pa/m", 2e4, "kPa/m", 1e3),
        ("Pa s", 0.004, "mPa·s", 1e-3),
        ("Pa", 1e7, "MPa", 1e6),
        ("Pa", 0.0, "Pa", 1.0),
        ("m3/s", 5e-7, "cm³/s", 1e-6),
        ("m", 0.002, "mm", 1e-3),
        ("m2", 1e-9, "m²", 1.0),
        ("kg/m3", 2000.0, "kg/m³", 1.0),
        ("", 0.5, "", 1.0),
    ],
)
def test_values_are_shown_in_a_unit_that_fits_them(unit, largest, shown, size):
    assert shown_unit(unit, largest) == Unit(shown, size)


def test_labels_carry_their_units():
    assert axis_scale(GRADIENT, numbers(1, 2)).text == "pressure gradient [Pa/m]"
    assert axis_scale("specimen.solid_fraction", numbers(0.1)).text == "specimen solid fraction"
    flow = results_in(["flow_rate_middle_ci95_m3_s"])[0]
    scale = result_scale(flow, np.array([1e-7, np.nan]), beside_log=False)
    assert scale.text == "particle flow rate, middle [cm³/s]"


def test_words_stand_one_after_another_in_the_order_in_which_they_come():
    scale = axis_scale("specimen.exit", pd.Series(["open", "closed", "open"], dtype="string"))
    assert scale.words == ("open", "closed")
    assert scale.place(pd.Series(["closed", "open"])).tolist() == [1.0, 0.0]
    assert axis_scale("output.paraview", pd.Series([True, False])).words == ("True", "False")


def test_one_axis_shows_means_intervals_runs_and_the_estimate(tmp_path, caught):
    rows = [(value,) for value in (1.0, 10.0, 100.0)]
    plan, pooled, pictures = sweep(tmp_path, [GRADIENT], rows, replicates=2, bad={2, 5})
    assert [picture.name for picture in pictures] == ["flow_rate", "flowing_velocity"]
    (axes,) = caught.figures[0][1].axes
    assert (axes.get_xscale(), axes.get_xlabel()) == ("log", "pressure gradient [Pa/m]")
    assert axes.get_ylabel() == "particle flow rate [mm³/s]"
    means = [bars.lines[0].get_ydata() for bars in axes.containers]
    for drawn, name in zip(means, ("entrance", "middle"), strict=True):
        column = pooled[f"flow_rate_{name}_m3_s"] / 1e-9
        np.testing.assert_allclose(drawn, column, **EXACT)
    ends = np.array([bar[:, 1] for bar in axes.containers[0].lines[2][0].get_segments()[:2]])
    ci95 = pooled["flow_rate_entrance_ci95_m3_s"][:2].to_numpy() / 1e-9
    np.testing.assert_allclose(np.ptp(ends, axis=1), 2 * ci95, rtol=1e-9)  # a difference
    (dots, _) = [line for line in axes.lines if line.get_marker() == "."]
    assert dots.get_ydata().size == 4
    x, y = np.hstack(
        [line.get_data() for line in axes.lines if line.get_linestyle() in ("--", ":")]
    )
    known = np.isfinite(y)
    assert known.sum() == 81  # each part of the curve once, inside the law's validity or outside
    law = predict(plan.scene(plan.points[0]), x[known]).particle_flow_rate_m3_s
    np.testing.assert_allclose(y[known], law / 1e-9, **EXACT)
    assert labels_of(caught.figures[0][1]) == [
        "particle flow rate, entrance",
        "particle flow rate, middle",
        "single runs",
        "no usable run",
        "Darcy estimate",
        "Darcy estimate, not valid",
    ]


def test_where_the_other_axis_changes_too_the_estimate_is_that_of_the_points(tmp_path, caught):
    rows = [(10.0, 0.9), (20.0, 0.6), (40.0, 0.1)]
    _, pooled, _ = sweep(tmp_path, [GRADIENT, PHI], rows)
    (axes,) = caught.figures[0][1].axes
    (curve,) = [line for line in axes.lines if line.get_linestyle() == ":"]
    estimate = pooled["estimate_flow_rate_m3_s"] / 1e-6
    assert curve.get_xdata().tolist() == [10.0, 20.0, 40.0]
    np.testing.assert_allclose(np.nanmax(curve.get_ydata()), estimate.max(), **EXACT)


def test_the_estimate_along_a_key_of_whole_numbers(tmp_path, caught):
    plan, _, _ = sweep(tmp_path, ["particles.count"], [(20,), (30,)])
    (axes,) = caught.figures[0][1].axes
    (curve,) = [line for line in axes.lines if line.get_linestyle() == ":"]
    assert curve.get_xdata().tolist() == list(range(20, 31))
    for place, point in ((0, plan.points[0]), (-1, plan.points[1])):
        law = predict(plan.scene(point)).particle_flow_rate_m3_s / 1e-9
        assert curve.get_ydata()[place] == pytest.approx(law, rel=1e-12)


def test_words_have_an_estimate_each_and_nothing_between(tmp_path, caught):
    sweep(tmp_path, ["specimen.exit"], [("closed",), ("open",)])
    (axes,) = caught.figures[0][1].axes
    assert [label.get_text() for label in axes.get_xticklabels()] == ["closed", "open"]
    marks = [line for line in axes.lines if line.get_marker() == "_" and line.get_label()[0] == "_"]
    assert all(line.get_linestyle() == "None" for line in marks)
    assert axes.get_xlim() == (-0.5, 1.5)


def test_two_axes_give_a_map_and_lines(tmp_path, caught):
    values = ((1.0, 10.0, 100.0, 1000.0), (0.2, 0.5, 1.0))
    plan, pooled, pictures = sweep(
        tmp_path, [GRADIENT, PHI], list(itertools.product(*values)), bad={1}
    )
    assert [picture.name for picture in pictures][:2] == [
        "flow_rate_entrance_map",
        "flow_rate_entrance_lines",
    ]
    mapped, lines = caught.figures[0][1], caught.figures[1][1]
    mesh = mapped.axes[0].collections[0]
    grid = pooled["flow_rate_entrance_m3_s"].to_numpy().reshape(4, 3).T / 1e-6
    np.testing.assert_allclose(mesh.get_array().filled(np.nan), grid, **EXACT)
    assert isinstance(mesh.norm, LogNorm)
    assert mapped.axes[1].get_ylabel() == "particle flow rate, entrance [cm³/s]"
    (cell,) = [patch for patch in mapped.axes[0].patches if isinstance(patch, Rectangle)]
    assert cell.get_x() < 1.0 < cell.get_x() + cell.get_width()
    assert cell.get_y() < 0.5 < cell.get_y() + cell.get_height()
    assert labels_of(mapped) == ["failed"]
    axes = lines.axes[0]
    assert axes.get_xscale() == axes.get_yscale() == "log"
    assert labels_of(lines)[:3] == ["specimen phi 0.2", "specimen phi 0.5", "specimen phi 1"]
    curves = [line for line in axes.lines if line.get_linestyle() == ":"]
    ends = [np.nanmax(line.get_ydata()) for line in curves]
    for end, phi in zip(ends, values[1], strict=True):
        (point,) = [p for p in plan.points if dict(p.values) == {GRADIENT: 1000.0, PHI: phi}]
        law = predict(plan.scene(point)).particle_flow_rate_m3_s / 1e-6
        assert end == pytest.approx(law, rel=1e-12)


def test_of_many_values_seven_are_drawn_and_the_caption_says_so(tmp_path, caught):
    rows = list(
        itertools.product(np.linspace(1.0, 9.0, 9).tolist(), np.linspace(0.1, 1, 8).tolist())
    )
    _, _, pictures = sweep(tmp_path, [GRADIENT, PHI], rows)
    lines = caught.figures[1][1]
    drawn = [label for label in labels_of(lines) if label.startswith("specimen phi")]
    assert (len(drawn), drawn[0], drawn[-1]) == (7, "specimen phi 0.1", "specimen phi 1")
    assert "1 more values are not drawn" in pictures[1].caption


def test_a_sample_of_two_axes_and_any_three_have_a_panel_each(tmp_path, caught):
    sample = [(1.0, 0.5), (2.0, 0.9), (3.0, 0.1), (4.0, 0.7)]
    sweep(tmp_path / "sample", [GRADIENT, PHI], sample)
    cube = list(itertools.product((1.0, 2.0), (0.1, 0.9), ("open", "closed")))
    _, pooled, pictures = sweep(tmp_path / "cube", [GRADIENT, PHI, "specimen.exit"], cube, bad={0})
    assert {painter for painter, _ in caught.figures} == {"paint_effects"}
    assert [len(figure.axes) for _, figure in caught.figures[::3]] == [2, 3]
    panel = caught.figures[3][1].axes[0]
    mean = panel.lines[1]
    flow = pooled["flow_rate_entrance_m3_s"].to_numpy().reshape(2, 4) / 1e-9
    np.testing.assert_allclose(mean.get_ydata(), flow[:, 1:].mean(axis=1), **EXACT)
    assert "known at every value" in pictures[0].caption


def test_without_a_varying_axis_or_a_result_there_is_no_figure(tmp_path, caught):
    assert sweep(tmp_path / "one", [GRADIENT], [(1.0,)], replicates=3)[2] == ()
    assert sweep(tmp_path / "bad", [GRADIENT], [(1.0,), (2.0,)], bad={0, 1})[2] == ()


def test_means_that_are_not_steady_are_hollow(tmp_path, caught):
    sweep(tmp_path, [GRADIENT], [(1.0,), (2.0,)], verdict="not_steady")
    (axes,) = caught.figures[0][1].axes
    hollow = [line for line in axes.lines if line.get_markerfacecolor() == "white"]
    assert [line.get_xdata().size for line in hollow] == [2, 2]
    assert "not steady" in labels_of(caught.figures[0][1])


def test_where_nothing_flows_a_map_is_of_one_colour_in_the_unit_of_the_estimate(tmp_path, caught):
    still = {"particle_flow_rate_m3_s": {"mean": 0.0, "ci95": 1e-9, "steady": True}}
    rows = list(itertools.product((1.0, 2.0), (0.2, 0.5)))
    sections = dict.fromkeys(("entrance", "middle"), still)
    _, _, pictures = sweep(tmp_path, [GRADIENT, PHI], rows, sections=sections)
    mapped = caught.figures[0][1]
    mesh = mapped.axes[0].collections[0]
    assert mesh.norm.vmin < 0.0 < mesh.norm.vmax
    assert mapped.axes[1].get_ylabel() == "particle flow rate, entrance [mm³/s]"
    assert len(pictures) == 6


def series(y, error, **changes):
    y = np.array(y)
    parts = {
        "x": np.arange(1.0, 1.0 + y.size),
        "y": y,
        "error": np.array(error),
        "steady": np.ones(y.size, dtype=bool),
        "dots": (np.array([]), np.array([])),
        **changes,
    }
    return Series("a result", "#0072B2", "o", **parts)


@pytest.mark.parametrize("log", [False, True])
def test_an_interval_that_is_huge_does_not_hide_the_values(log):
    figure = Figure()
    scales = Scale("x", PLAIN), Scale("y", PLAIN, log=log)
    paint_series(*scales, [series([1.0, 2.0, 3.0], [0.1, 1e6, np.nan])], [], figure)
    low, high = figure.axes[0].get_ylim()
    assert high < 20.0
    assert low > -3.0
    assert low < 1.0


def test_a_single_value_without_an_interval_can_be_drawn():
    figure = Figure()
    lone = series([0.0], [np.nan])
    paint_series(Scale("x", PLAIN), Scale("y", PLAIN), [lone], [], figure)
    low, high = figure.axes[0].get_ylim()
    assert low < 0.0 < high


def cells(**changes):
    x, y = np.meshgrid([1.0, 2.0, 10.0], [1.0, 10.0], indexing="ij")
    table = {"x": x.ravel(), "y": y.ravel(), "value": np.arange(1.0, 7.0), "state": "valid"}
    return pd.DataFrame(table | changes)


def test_cells_of_a_map_meet_half_way_as_their_scales_have_it():
    figure = Figure()
    scales = Scale("x", PLAIN), Scale("y", PLAIN, log=True), Scale("z", PLAIN)
    paint_map(*scales, cells(), figure)
    corners = figure.axes[0].collections[0].get_coordinates()
    np.testing.assert_allclose(corners[0, :, 0], [0.5, 1.5, 6.0, 14.0], **EXACT)
    tenth = np.sqrt(10.0)
    np.testing.assert_allclose(corners[:, 0, 1], [1 / tenth, tenth, 10 * tenth], **EXACT)


def test_every_kind_of_lacking_cell_has_its_own_hatch_in_the_legend():
    figure = Figure()
    states = ["failed", "invalid", "unfinished", "nothing", "valid", "not_steady"]
    table = cells(state=states, value=[np.nan] * 4 + [1.0, 2.0])
    paint_map(Scale("x", PLAIN), Scale("y", PLAIN), Scale("z", PLAIN), table, figure)
    patches = [p for p in figure.legends[0].get_patches() if isinstance(p, Patch)]
    assert labels_of(figure) == ["not steady", "failed", "invalid", "not finished", "no value"]
    assert len({patch.get_hatch() for patch in patches}) == 4
    cells_drawn = [p for p in figure.axes[0].patches if isinstance(p, Rectangle)]
    assert len(cells_drawn) == 4
    (rings,) = [line for line in figure.axes[0].lines if line.get_marker() == "o"]
    assert rings.get_data()[0].tolist() == [10.0]


def png(paint, *arguments):
    data = collecting.draw(lambda figure: paint(*arguments, figure), 4.2)
    return Image.open(io.BytesIO(data))


@pytest.mark.parametrize("x", [Scale("x", PLAIN), Scale("x", PLAIN, log=True)])
@pytest.mark.parametrize("y", [Scale("y", PLAIN), Scale("y", PLAIN, log=True)])
def test_all_painters_make_pictures_on_all_scales(x, y):
    """The common style sets ticks of every axis: it must meet no scale that it cannot."""
    at = np.array([1.0, 2.0, 3.0])
    curve = Curve("law", "#1B1B1B", at, at, np.array([True, True, False]))
    drawn = [
        png(paint_series, x, y, [series([1.0, np.nan, 30.0], [0.1] * 3)], [curve]),
        png(paint_map, x, y, Scale("z", PLAIN, log=x.log), cells()),
        png(paint_effects, y, [Panel(x, at, at, (at, at))] * 3),
    ]
    words = Scale("w", PLAIN, words=("a", "a very long word indeed", "c"))
    zero = series([1.0, 2.0, 3.0], [0.1] * 3, x=np.arange(3.0))
    drawn.append(png(paint_series, words, y, [zero], [curve]))
    assert all(picture.size == (1064, 798) for picture in drawn)


def test_numbers_on_a_logarithmic_axis_are_few_and_plain():
    figure = Figure()
    axes = figure.add_subplot()
    for low, high, expected in [
        (1.0, 100.0, ["1", "2", "5", "10", "20", "50", "100"]),
        (1e-3, 10.0, ["0.001", "0.01", "0.1", "1", "10"]),
    ]:
        Scale("x", PLAIN, log=True).dress(axes, "x", low, high)
        assert [label.get_text() for label in axes.get_xticklabels()] == expected
    Scale("x", PLAIN, log=True).dress(axes, "x", 1e-12, 1e12)
    assert len(axes.get_xticks()) <= 7


def test_columns_of_axes_do_not_hide_results():
    assert axis_column(GRADIENT) not in [result.column for result in results_in([])]
