"""The settings of the runs held against the paper's own, packing by packing."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from paper_results import answer, every, linear, shipped

from liggghts_driver.paper.catalogue import SETTINGS, sweep_file
from liggghts_driver.paper.cost import cost_sentence, cost_table
from liggghts_driver.paper.settings import settings_answer, shared_settings
from liggghts_driver.paper.stored import NOT_RUN
from liggghts_driver.paper.verdict import reading_verdicts
from liggghts_driver.sweeps.plan import make_plan


def off_by(*shares):
    """The paper's settings have flow rates that differ by these shares, packing by packing."""

    def rule(sweep, values, replicate):
        if sweep != SETTINGS.sweep:
            return 1e-6 * (1.0 + 0.3 * replicate)
        if replicate >= len(shares):
            return None
        return 1e-6 * (1.0 + 0.3 * replicate) * (1.0 + shares[replicate])

    return shipped(rule)


def slow(found):
    """The same answer after 100 s for each simulated second, in steps of 0.1 ms."""
    return replace(found, cost={**found.cost, "cpu_s": 5000.0, "step_s": 1e-4})


class TestTheirError:
    def test_it_is_that_of_the_same_packings(self):
        """Packings differ by 60 %, the settings in each by 1, 2 and 3 %: t / sqrt(3) of 1 %."""
        words = settings_answer(off_by(0.01, 0.02, 0.03))
        half = 4.302652729911275 / math.sqrt(3.0)
        assert f"past the entrance by +2.0 ± {half:.1f} %" in words
        assert "That is within the 5 % that judgements on this page allow for" in words

    @pytest.mark.parametrize(
        ("shares", "told"),
        [
            ((0.10, 0.101, 0.099), "That is more than the 5 %"),
            ((-0.10, -0.101, -0.099), "That is more than the 5 %"),
            ((0.0, 0.03, 0.06), "These packings do not tell whether that is within the 5 %"),
            ((0.01,), "One packing does not tell whether that is within the 5 %"),
            ((), f"(`cases/paper/settings.toml`): {NOT_RUN}."),
        ],
    )
    def test_whether_judgements_allow_for_it(self, shares, told):
        assert told in settings_answer(off_by(*shares))


class TestTheSweep:
    def test_it_has_the_paper_s_step_and_stiffness_and_the_packings_of_the_others(self):
        plan, first = make_plan(sweep_file(SETTINGS.sweep)), make_plan(sweep_file("gradient"))
        scenes = [plan.scene(p) for p in plan.points]
        assert {(s.time.step, s.contact.stiffness_scale) for s in scenes} == {(1e-4, 1.0)}
        others = [first.scene(p) for p in first.points if p.values == {"pressure.gradient": 10.0}]
        assert [s.seed for s in scenes] == [s.seed for s in others]
        same = {"contact", "time", "drag", "output"}
        for ours, theirs in zip(scenes, others, strict=True):
            assert ours.model_dump(exclude=same) == theirs.model_dump(exclude=same)

    def test_it_is_no_reading(self):
        """Its flow rates are the paper's: that does not make the paper's example come out."""
        stored = every(
            lambda name, n: (
                answer(1.97e-6, 1.86e-6 * (1.0 + 1e-4 * n))
                if name == SETTINGS.sweep
                else answer(1e-6 * (1.0 + 0.01 * n))
            )
        )
        assert set(reading_verdicts(stored).values()) == {"no"}

    def test_the_settings_that_the_others_share_are_said(self):
        """All but those of this sweep."""
        assert shared_settings(linear()) == ["time.step = 0.0005"]


class TestTheirCost:
    def test_each_has_its_own(self):
        """16 s for a second with ours, 100 s with the paper's own."""
        stored = every(
            lambda name, _: slow(answer(1e-6)) if name == SETTINGS.sweep else answer(1e-6)
        )
        words = cost_sentence(stored)
        assert "A simulated second takes 16 s" in words
        assert "stiffness a simulated second takes 100 s (3 runs): 2.2 times" in words
        rows = cost_table(stored).splitlines()
        assert sum("ten times softer" in row for row in rows) == 1
        assert sum("the paper's | 0.10 ms | 100" in row for row in rows) == 1
