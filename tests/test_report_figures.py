from __future__ import annotations

import re
from functools import partial

import numpy as np
import pytest
from matplotlib.figure import Figure
from report_answers import (
    ENTRANCE_M3_S,
    STEADY_FROM_S,
    VELOCITY_M_S,
    collision,
    infiltration,
)

from liggghts_driver.report.figures import draw_figures
from liggghts_driver.report.motion import paint_motion, paint_piston
from liggghts_driver.report.rates import paint_velocity, paint_volumes
from liggghts_driver.report.style import draw

#: Figures are drawn in doubles: what is left is rounding.
EXACT = {"rtol": 1e-12}


def painted(paint, answer):
    """The figure that a painter makes, as its axes and what stands in its legend."""
    figure = Figure()
    paint(answer, figure)
    labels = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    return figure.axes, labels


def line(axes, label):
    """Times and values of the line with a label."""
    (found,) = [one for one in axes.lines if one.get_label() == label]
    return np.asarray(found.get_xdata()), np.asarray(found.get_ydata())


@pytest.mark.parametrize(
    ("paint", "make"),
    [
        (paint_volumes, infiltration),
        (paint_velocity, infiltration),
        (lambda answer, figure: paint_piston(answer, 1e-3, figure), infiltration),
        (paint_motion, collision),
    ],
)
def test_every_axis_has_a_label_with_its_unit(paint, make):
    panels, _ = painted(paint, make()[1])
    assert all(re.search(r"\S \[\S+\]$", axes.get_ylabel()) for axes in panels)
    assert re.search(r"^time \[m?s\]$", panels[-1].get_xlabel())


def test_the_volumes_are_the_series_and_the_estimate_is_its_rate_times_time():
    _, answer = infiltration()
    (axes,), labels = painted(paint_volumes, answer)
    assert axes.get_ylabel() == "volume of particles [cm³]"
    time, volume = line(axes, "simulation, middle")
    np.testing.assert_array_equal(time, answer.series["time_s"])
    np.testing.assert_allclose(volume * 1e-6, answer.series["volume_middle_m3"], **EXACT)
    rate = answer.results["estimate"]["particle_flow_rate_m3_s"]
    (label,) = [label for label in labels if label.startswith("estimate")]
    assert label == f"estimate $v_p Q t$, {rate * 1e6:.3g} cm³/s"
    time, volume = line(axes, label)
    np.testing.assert_allclose(volume * 1e-6, rate * time, **EXACT)


def test_the_fitted_slope_is_drawn_where_it_was_fitted_with_its_interval_in_the_legend():
    _, answer = infiltration()
    (axes,), labels = painted(paint_volumes, answer)
    assert "slope 0.679 ± 0.067 cm³/s" in labels
    assert "steady part" in labels
    time, volume = line(axes, "slope 0.679 ± 0.067 cm³/s")
    assert (time[0], time[-1]) == (STEADY_FROM_S, 1.0)
    # The made-up curve is straight there, so that its fit lies on it.
    np.testing.assert_allclose(volume * 1e-6, ENTRANCE_M3_S * (time - 0.2), **EXACT)


def test_what_is_not_steady_is_called_so():
    _, answer = infiltration()
    answer.results["sections"]["middle"]["particle_flow_rate_m3_s"]["steady"] = False
    _, labels = painted(paint_volumes, answer)
    assert "fitted part, not steady" in labels
    assert "steady part" not in labels


def test_a_rate_that_is_unknown_is_not_drawn():
    _, answer = infiltration()
    answer.results["sections"]["middle"]["particle_flow_rate_m3_s"].update(mean=None, ci95=None)
    _, labels = painted(paint_volumes, answer)
    assert sum(label.startswith("slope") for label in labels) == 1


def test_the_velocity_stands_beside_the_pore_velocity_and_its_mean():
    _, answer = infiltration()
    (above, below), labels = painted(paint_velocity, answer)
    pore = answer.results["estimate"]["pore_velocity_m_s"]
    label = f"estimate $q/v_2$, {pore * 1e3:.3g} mm/s"
    assert label in labels
    assert line(above, label)[1][0] == pytest.approx(pore * 1e3, rel=1e-12)
    _, mean = line(above, "mean 1.65 ± 0.10 mm/s")
    np.testing.assert_allclose(mean, 1e3 * VELOCITY_M_S, **EXACT)
    np.testing.assert_array_equal(line(below, "of these flowing")[1], answer.series["flowing"])


def test_the_piston_is_pushed_back_by_a_positive_resistance():
    _, answer = infiltration()
    (above, below), labels = painted(lambda a, figure: paint_piston(a, 2e-3, figure), answer)
    assert above.get_ylabel() == "position x [mm]"
    np.testing.assert_allclose(1e-3 * above.lines[0].get_ydata(), answer.series["piston_x_m"])
    assert line(below, "resistance of the contacts")[1].max() == pytest.approx(1.0)  # mN
    assert "driving force, 2.00 mN" in labels


def test_the_exact_speed_of_free_flight_is_drawn_where_it_is_known():
    _, answer = collision()
    _, labels = painted(paint_motion, answer)
    assert labels == []
    check = {"name": "free_flight_velocity_m_s", "simulated": -2e-3, "exact": -2.5e-3, "ratio": 0.8}
    answer.results["exact"].append(check)
    (above, _), labels = painted(paint_motion, answer)
    assert labels == ["exact free flight, 2.500 mm/s"]
    assert line(above, labels[0])[1][0] == pytest.approx(2.5)


def test_a_scene_gets_the_figures_that_it_calls_for():
    assert [picture.name for picture in draw_figures(*collision())] == ["motion"]
    case, answer = infiltration()
    answer.series["flowing_velocity_m_s"] = np.nan
    names = [picture.name for picture in draw_figures(case, answer)]
    assert names == ["volume", "piston"]


def test_a_run_in_which_nothing_comes_is_drawn_too():
    case, answer = infiltration()
    for column in ("volume_entrance_m3", "volume_middle_m3", "piston_force_n"):
        answer.series[column] = 0.0
    for section in answer.results["sections"].values():
        section["particle_flow_rate_m3_s"].update(mean=0.0, ci95=1e-9)
    assert len(draw_figures(case, answer)) == 3


def test_equal_data_give_equal_files():
    paint = partial(paint_volumes, infiltration()[1])
    assert draw(paint, 2.0) == draw(paint, 2.0)
