"""The figures of the page on the paper: what is drawn is what is stored, and nothing beside it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from matplotlib.figure import Figure
from paper_results import answer, linear, point, power_law, shipped, with_points

from liggghts_driver.paper.catalogue import ALL_GRADIENTS, GRADIENT, MAIN
from liggghts_driver.paper.figures import DRAWINGS, first_run
from liggghts_driver.paper.pooled import flows_by_gradient
from liggghts_driver.paper.stored import Stored


def painted(name, stored):
    figure = Figure()
    next(d for d in DRAWINGS if d.name == name).paint(stored, figure)
    return figure


def legend_of(name, stored):
    """The words of its legend."""
    return [text.get_text() for text in painted(name, stored).legends[0].get_texts()]


class TestFigures:
    @pytest.mark.parametrize("stored", [linear, lambda: shipped(lambda *_: None)])
    @pytest.mark.parametrize("drawing", DRAWINGS, ids=lambda d: d.name)
    def test_each_can_be_painted(self, drawing, stored):
        figure = Figure()
        drawing.paint(stored(), figure)
        assert figure.axes

    def test_points_are_the_stored_flow_rates(self):
        figure = Figure()
        next(d for d in DRAWINGS if d.name == "paper-flow").paint(linear(), figure)
        bars = figure.axes[0].containers[0]
        flows = flows_by_gradient(linear(), ALL_GRADIENTS, "entrance")
        assert bars.lines[0].get_ydata() == pytest.approx([1e6 * p.mean for p in flows.values()])

    def test_a_reading_without_points_of_its_own_is_not_drawn(self):
        """At 10 Pa/m the piston that follows is the paper's, which has run."""

        def rule(sweep, values, replicate):
            return 1e-6 if sweep in ("gradient", "more_gradients") else None

        assert "piston follows" in legend_of("paper-flow", linear())
        assert "piston follows" not in legend_of("paper-flow", shipped(rule))
        assert "v_f = a t" not in legend_of("paper-velocity", shipped(rule))

    def test_an_interval_that_goes_on_to_zero_ends_in_an_arrow(self):
        def rule(sweep, values, replicate):
            return 1e-6 * (1.0 + (0.9 if values.get(GRADIENT) == 1.0 else 0.01) * (replicate - 1))

        figure = painted("paper-flow", shipped(rule))
        bars, arrow = figure.axes[0].containers[:2]
        low, high = bars.lines[2][0].get_segments()[0][:, 1]
        assert (low, high) == pytest.approx((1.0, 1.0 + 0.9 * 2.484), rel=1e-3)  # t / sqrt(3)
        assert arrow.lines[2][0].get_segments()[0][:, 1] == pytest.approx((0.4, 1.0))

    def test_a_rate_that_still_comes_up_is_pale(self):
        up = replace(answer(1e-6), reached_s={"entrance": 1.0, "middle": None})
        points = tuple(
            point(p.values, p.replicate, up if p.values[GRADIENT] == 1.0 else answer(1e-6))
            for p in linear().points("gradient")
        )
        stored = Stored({"gradient": with_points(linear(), "gradient", points)})
        figure = painted("paper-flow", stored)
        for axes, expected in zip(figure.axes[:2], ([1.0], [0.4, 1.0]), strict=True):
            assert [bars.lines[0].get_alpha() for bars in axes.containers] == expected

    @pytest.mark.parametrize(("power", "marker"), [(3.0, "^"), (-2.0, "v")])
    def test_an_exponent_outside_of_the_panel_has_a_mark_at_its_edge(self, power, marker):
        below = painted("paper-flow", shipped(power_law(power))).axes[2]
        low, high = below.get_ylim()
        edge = high if power > 0.0 else low
        marks = [
            line for line in below.lines
            if line.get_marker() == marker and abs(line.get_ydata()[0] - edge) < 0.1
        ]  # fmt: skip
        neighbours = (8, 4, 2)  # of the gradients of each series
        assert len(marks) == sum(neighbours)

    def test_what_was_simulated_stands_on_the_charts(self):
        """The particle fraction and the porosity; a point for each section and value."""
        panels = painted("paper-what-if", linear()).axes
        places = [sorted({bars.lines[0].get_xdata()[0] for bars in a.containers}) for a in panels]
        assert places == [[0.1, 0.15, 0.25], [0.45, 0.5], [], []]
        assert [len(axes.containers) for axes in panels[:2]] == [6, 4]

    def test_spheres_are_shown_of_a_sound_run_alone(self):
        def at_ten(verdict):
            points = tuple(
                point(p.values, p.replicate, answer(1e-6, verdict=verdict))
                for p in linear().points("gradient")
            )
            return first_run(Stored({"gradient": with_points(linear(), "gradient", points)}))

        assert at_ten("invalid") is None
        assert at_ten("not_steady").values[GRADIENT] == 10.0

    def test_friction_is_drawn_with_the_packings_that_all_have(self):
        def rule(sweep, values, replicate):
            if sweep == "friction" and (replicate > 1 or values["contact.friction"] == 0.5):
                return None
            return 1e-6 * (1 + replicate)

        axes = painted("paper-friction", shipped(rule)).axes[0]
        assert axes.get_title(loc="left").startswith("2 packings")
        assert axes.lines[0].get_ydata()[-1] == pytest.approx(1.5 * 49.5, rel=1e-3)

    def test_curves_are_the_stored_volumes(self):
        figure = Figure()
        next(d for d in DRAWINGS if d.name == "paper-volumes").paint(linear(), figure)
        curve = figure.axes[0].lines[0].get_ydata()
        flow = flows_by_gradient(linear(), MAIN, "entrance")[10.0]
        assert curve[-1] == pytest.approx(1e6 * flow.mean * 49.5, rel=1e-4)  # whole mm3
