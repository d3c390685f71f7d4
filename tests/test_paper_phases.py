"""The phases of a run, and what pushes particles in them: told from made-up curves."""

from __future__ import annotations

from dataclasses import replace

import pytest
from paper_results import INTERVAL_S, SAMPLES, answer, every, linear, point, with_points

from liggghts_driver.paper import law
from liggghts_driver.paper.catalogue import GRADIENT
from liggghts_driver.paper.phases import bounce_of, phases_answer
from liggghts_driver.paper.push import push_answer, push_table
from liggghts_driver.paper.stored import Stored
from liggghts_driver.report.numbers import number


def piston_m(time_s):
    """Falls to 0.15 m in 12 s, goes back by 5 mm in 2 s and forth in 4, then creeps at 0.3 mm/s."""
    if time_s <= 12.0:
        return 0.15 * (time_s / 12.0) ** 2
    if time_s <= 14.0:
        return 0.15 - 0.0025 * (time_s - 12.0)
    if time_s <= 18.0:
        return 0.145 + 0.00125 * (time_s - 14.0)
    return 0.15 + 0.0003 * (time_s - 18.0)


def bouncing():
    found = answer(1e-6)
    places = [round(1e6 * (piston_m(INTERVAL_S * n) - 0.205)) for n in range(SAMPLES)]
    return replace(found, curves=replace(found.curves, piston_x_um=places))


def at_ten(found):
    """The first reading at 10 Pa/m alone has run."""
    points = tuple(
        point(p.values, p.replicate, found if p.values[GRADIENT] == 10.0 else None)
        for p in linear().points("gradient")
    )
    return Stored({"gradient": with_points(linear(), "gradient", points)})


class TestPhases:
    def test_a_piston_that_bounces(self):
        found = bounce_of(bouncing().curves)
        assert INTERVAL_S * found.met == 12.0
        assert INTERVAL_S * found.turned == 14.0
        assert INTERVAL_S * found.returned == 18.5  # the first sample beyond
        assert found.back_m == pytest.approx(0.005)

    def test_a_piston_that_never_goes_back(self):
        assert bounce_of(answer(1e-6).curves) is None
        assert phases_answer(at_ten(answer(1e-6))) == []

    def test_a_piston_that_does_not_return(self):
        found = answer(1e-6)
        places = [-abs(n - 30) for n in range(SAMPLES)]
        bounce = bounce_of(replace(found.curves, piston_x_um=places))
        assert (bounce.met, bounce.returned) == (30, SAMPLES - 1)

    def test_in_words(self):
        entry, standstill, creep = phases_answer(at_ten(bouncing()))
        assert entry.startswith("*Entry*, to 12 s: the piston falls, at last with 24 mm/s")
        # 1 cm3/s: 2 s back, and 4.5 s forth.
        assert "its fluid with it, a net 2.0 cm³ enter, although" in standstill
        assert "as it comes forth again, 4.5. (In" in standstill
        assert standstill.startswith("*Standstill*, to 18 s")
        assert "bounces back by 5.0 mm" in standstill
        assert "creeps at 0.30 mm/s over the second half" in creep
        assert "1.00 and 1.00 past the entrance" in creep

    def test_without_runs(self):
        assert phases_answer(Stored()) == ["Not run yet."]


class TestPushes:
    def test_the_piston_weighs_what_the_suspension_does(self):
        """0.205 m x 0.01 m2 with 0.15 of 7000 and 0.85 of 2000 kg/m3."""
        expected = 0.205 * 0.01 * (0.15 * 7000.0 + 0.85 * 2000.0)
        assert law.piston_mass_kg() == pytest.approx(expected, rel=5e-3)  # 0.205 is rounded
        assert law.piston_force_n() == pytest.approx(expected * 2.143e-3, rel=5e-3)

    def test_the_force_on_all_inside(self):
        """8000 particles, 2 pi r^3 times 10 Pa/m on each."""
        row = next(line for line in push_table(at_ten(bouncing())).splitlines() if "| 10 |" in line)
        force_n = 8000 * 2.0 * 3.14159265 * 1.5e-3**3 * 10.0
        cells = [cell.strip() for cell in row.strip("|").split("|")]
        assert cells[1] == number(8000)
        assert float(cells[2]) == pytest.approx(1e3 * force_n, rel=0.03)  # two digits
        assert float(cells[3]) == pytest.approx(law.piston_force_n() / force_n, rel=0.05)

    def test_without_runs_it_says_so(self):
        assert push_table(linear()).count("not run yet") == 0
        assert push_table(at_ten(bouncing())).count("not run yet") == 2 * 4

    def test_in_words(self):
        """The made-up flow rates hang on no piston."""
        *pistons, fluid = push_answer(linear())
        assert [words.split("changes")[0] for words in pistons] == [
            "A piston 2.6 times lighter (2.15 kg) ",
            "A piston 26 times lighter (0.215 kg) ",
        ]
        assert "is 55 times the force of 10 Pa/m" in fluid

    @pytest.mark.parametrize(("enters", "empties"), [(0.8e-6, True), (1.2e-6, False)])
    def test_a_half_that_empties_is_told(self, enters, empties):
        """1.15e-6 m3/s leave it past the middle; the heavy piston has 1.7e-6 and 1.2e-6."""

        def made(name, replicate):
            return answer(enters, 1.15e-6) if name == "piston_mass" else answer(1.7e-6, 1.2e-6)

        told = " ".join(push_answer(every(made)))
        assert "So the piston counts at the entrance." in told
        assert ("the half between empties" in told) == empties
