"""The table of the paper's claims: each verdict follows from the numbers."""

from __future__ import annotations

from dataclasses import replace

import pytest
from paper_results import answer, as_free_flight, linear, point, power_law, shipped, with_points

from liggghts_driver.paper.catalogue import GRADIENT
from liggghts_driver.paper.claims import claims
from liggghts_driver.paper.law import law_flow_m3_s
from liggghts_driver.paper.page import render_page
from liggghts_driver.paper.printed import ROWS
from liggghts_driver.paper.speeds import ALL
from liggghts_driver.paper.stored import NOT_RUN, Stored

FLOWS, STEADY, POWER, LAW, VELOCITY, FRICTION = range(6)


def first_reading(made):
    """The first reading alone: an answer by gradient and packing."""
    points = tuple(
        point(p.values, p.replicate, made(p.values[GRADIENT], p.replicate))
        for p in linear().points("gradient")
    )
    return Stored({"gradient": with_points(linear(), "gradient", points)})


def both_readings(made):
    """The two readings of the outside fluid."""
    first = first_reading(made).sweeps["gradient"]
    second = with_points(linear(), "outside_fluid", first.points)
    return Stored({"gradient": first, "outside_fluid": second})


def as_the_paper(gradient, replicate):
    """Its flow rates, and velocities within its ranges."""
    row = ROWS[gradient]
    chance = 1.0 + 0.02 * (replicate - 1) * (1.0 if gradient < 5.0 else -1.0)
    speed = 0.5 * sum(row.velocity_m_s)
    found = answer(row.entrance_m3_s * chance, row.middle_m3_s * chance, velocity_m_s=speed)
    return replace(found, velocity_range_m_s=(0.99 * speed, 1.01 * speed))


def even(found):
    """The entrance's flow rate past both sections."""
    return dict.fromkeys(found.flow_m3_s, found.flow_m3_s["entrance"])


class TestClaims:
    def test_nothing_is_known_without_runs(self):
        found = claims(shipped(lambda *_: None))
        assert {claim.verdict for claim in found} == {"not run yet"}
        assert all(NOT_RUN in claim.found for claim in found)

    def test_runs_like_the_papers_uphold_it(self):
        """But the made-up front passes the middle after 12 s, and the paper's are up to 10 % above
        the law that its equations give."""
        found = claims(first_reading(as_the_paper))
        verdicts = ["yes", "not decided", "yes", "not decided", "yes", NOT_RUN]
        assert [claim.verdict for claim in found] == verdicts
        assert "within it at 1, 2, 5, 10 and 20 Pa/m" in found[VELOCITY].found
        assert "in 3 at the entrance and in 0 at the middle" in found[STEADY].found
        assert "after 12.0 s" in found[STEADY].found
        assert "1.970 ± 0.098" in found[FLOWS].found

    def test_the_whole_flow_is_steady_where_it_comes_early_too(self):
        def made(gradient, replicate):
            early = {"entrance": 1.0, "middle": 9.0}
            return replace(as_the_paper(gradient, replicate), reached_s=early)

        assert claims(first_reading(made))[STEADY].verdict == "yes"

    def test_one_packing_is_not_steady_and_not_unsteady(self):
        """It has come early and is steady; without another it is not told."""

        def made(gradient, replicate):
            early = replace(answer(1e-6), reached_s={"entrance": 1.0, "middle": 9.0})
            return early if replicate == 0 else None

        assert claims(both_readings(made))[STEADY].verdict == "not decided"

    def test_one_run_that_stops_is_enough(self):
        """Something may happen if it happens once, among others in which it does not."""

        def rule(sweep, values, replicate):
            stops = sweep == "friction" and replicate == 2
            return 1.9e-6 * (1e-5 if stops else 0.1 if sweep == "friction" else 1.0)

        assert claims(shipped(rule))[FRICTION].verdict == "yes"

    def test_a_law_is_not_followed_to_a_gradient_that_did_not_run(self):
        """It is to hold from 1 to 10 Pa/m; 10 Pa/m is missing."""

        def made(gradient, replicate):
            power = 1.0 + 0.02 * (replicate - 1)
            rate = law_flow_m3_s(10.0) * (gradient / 10.0) ** power
            return None if gradient >= 10.0 else answer(rate, rate)

        found = claims(both_readings(made))[LAW]
        assert found.verdict == "not decided"
        assert "on it at 1, 2 and 5 Pa/m" in found.found

    def test_one_packing_decides_nothing(self):
        def made(gradient, replicate):
            return as_the_paper(gradient, replicate) if replicate == 0 else None

        found = claims(first_reading(made))
        assert [claim.verdict for claim in found[:FRICTION]] == ["not decided"] * 5

    def test_a_flow_that_goes_otherwise_with_the_gradient(self):
        found = claims(as_free_flight())
        assert found[POWER].verdict == "no"
        assert "with the piston: power 0.740 ± 0.050 (3) at the entrance" in found[POWER].found
        assert found[LAW].verdict == "no"
        assert "with the piston: entrance, above it at 1" in found[LAW].found

    def test_one_reading_that_differs_leaves_the_claim_open(self):
        """And several that do refute it."""

        def made(gradient, replicate):
            return answer(1e-6 * (1.0 + 0.01 * replicate))

        assert claims(first_reading(made))[POWER].verdict == "not decided"
        assert claims(both_readings(made))[LAW].verdict == "no"

    def test_a_law_that_is_missed_at_one_gradient_is_not_followed(self):
        def made(gradient, replicate):
            rate = law_flow_m3_s(gradient) * (1.0 + 0.02 * (replicate - 1))
            rate *= {1.0: 4.5, 20.0: 0.6}.get(gradient, 1.0)
            return answer(rate, rate)

        assert claims(both_readings(made))[LAW].verdict == "no"

    def test_a_law_that_goes_on_is_followed_in_part(self):
        """It is said to end between 10 and 20 Pa/m."""

        def made(gradient, replicate):
            power = 1.0 + 0.02 * (replicate - 1)
            rate = law_flow_m3_s(10.0) * (gradient / 10.0) ** power
            return answer(rate * (1.0 + 0.02 * (replicate - 1)))

        found = claims(both_readings(lambda g, n: replace(made(g, n), flow_m3_s=even(made(g, n)))))
        assert found[LAW].verdict == "in part"

    def test_the_law_up_to_its_end(self):
        """Proportional up to 10 Pa/m, and as the root of the gradient beyond."""

        def made(gradient, replicate):
            ratio, power = gradient / 10.0, 1.0 + 0.02 * (replicate - 1)
            rate = 1.86e-6 * (1.0 + 0.02 * (replicate - 1)) * min(ratio**power, ratio**0.5)
            return answer(rate, rate)

        found = claims(first_reading(made))[LAW]
        assert found.verdict == "yes"
        assert "below it at 20 Pa/m" in found.found

    def test_a_wide_interval_tells_no_power(self):
        def rule(sweep, values, replicate):
            return 1.9e-6 * (values.get(GRADIENT, 10.0) / 10.0) ** (0.6 + 0.3 * replicate)

        assert claims(shipped(rule))[POWER].verdict == "not decided"

    @pytest.mark.parametrize(
        ("speed_m_s", "share", "verdict"),
        [
            (1.0e-2, 1.0, "no"),
            (1.0e-2, 0.01, "not decided"),
            (2.8e-3, 0.8, "no"),
            (1.0e-5, 1.0, "not decided"),
        ],
    )
    def test_velocities(self, speed_m_s, share, verdict):
        """2.8 mm/s is above the paper's ranges, overlaps that at 10 Pa/m, and is below at 20; a
        share of that is the mean of all inside. Were fewer counted, the mean would be higher."""

        def made(gradient, replicate):
            found = answer(1e-6, velocity_m_s=speed_m_s)
            return replace(found, faster_m_s={ALL: share * speed_m_s})

        assert claims(both_readings(made))[VELOCITY].verdict == verdict

    def test_velocities_that_are_the_papers_but_for_one_gradient(self):
        def made(gradient, replicate):
            found = as_the_paper(20.0 if gradient == 1.0 else gradient, replicate)
            return replace(found, faster_m_s={ALL: 2e-3} if gradient == 1.0 else {})

        assert claims(both_readings(made))[VELOCITY].verdict == "in part"

    def test_velocities_of_one_packing_decide_nothing(self):
        def made(gradient, replicate):
            return as_the_paper(gradient, replicate) if replicate == 0 else None

        assert claims(both_readings(made))[VELOCITY].verdict == "not decided"

    @pytest.mark.parametrize(
        ("left", "packings", "verdict"),
        [
            (1e-5, 3, "yes"),
            (1e-5, 1, "yes"),
            (0.01, 3, "in part"),
            (0.1, 3, "no"),
            (0.1, 1, "not decided"),
        ],
    )
    def test_friction(self, left, packings, verdict):
        """Something that may happen does so if it happens once; nearly stopped is a part of it."""

        def rule(sweep, values, replicate):
            if sweep == "friction":
                return 1.9e-6 * left if replicate < packings else None
            return 1.9e-6 * (1.0 + 0.01 * replicate)

        assert claims(shipped(rule))[FRICTION].verdict == verdict

    def test_the_page_has_them_all(self):
        stored = shipped(power_law(1.0))
        page = render_page(stored)
        for claim in claims(stored):
            assert f"| {claim.words} | {claim.found} | **{claim.verdict}** |" in page
