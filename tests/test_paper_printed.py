"""What the paper prints, beside what its own equations give: nothing here was run."""

from __future__ import annotations

import pytest

from liggghts_driver.paper import law
from liggghts_driver.paper.printed import (
    FIRST_ROW_AS_PRINTED_M3_S,
    PERMEABILITY_M2,
    ROWS,
    TABLE_1,
)
from liggghts_driver.paper.statements import slips, statements
from liggghts_driver.scene import make_scene

#: The paper prints three digits.
PRINTED = 5e-3


@pytest.mark.parametrize("row", TABLE_1)
def test_the_printed_law_is_ours_with_the_printed_permeability(row):
    """The law is linear in P*, which is printed 3 % above what Eqs. 10 and 11 give."""
    found = law.law(row.gradient_pa_m)
    slip = PERMEABILITY_M2 / found.effective_permeability_m2
    assert slip == pytest.approx(1.03, abs=0.001)
    assert found.particle_flow_rate_m3_s * slip == pytest.approx(row.law_m3_s, rel=PRINTED)
    assert found.pore_velocity_m_s * slip == pytest.approx(row.law_m_s, rel=PRINTED)


def test_the_first_row_is_read_with_the_exponent_of_its_law():
    row = TABLE_1[0]
    for read, printed in zip(
        (row.entrance_m3_s, row.middle_m3_s), FIRST_ROW_AS_PRINTED_M3_S, strict=True
    ):
        assert read == pytest.approx(printed / 10.0, rel=1e-12)
        assert read == pytest.approx(row.law_m3_s, rel=0.05)


@pytest.mark.parametrize(
    ("gradient", "velocity"),
    [(1.0, 5.06e-4), (2.0, 8.44e-4), (5.0, 1.66e-3), (10.0, 2.77e-3), (20.0, 4.63e-3)],
)
def test_free_flight(gradient, velocity):
    """C_D(Re) v² = 4 r |grad p| / rho_f, solved by hand to three digits."""
    assert law.free_flight_m_s(gradient) == pytest.approx(velocity, rel=2e-3)


def test_the_power_of_free_flight():
    """1 / (2 - 0.646) between Re = 1 and 400."""
    assert law.free_flight_exponent(1.0, 20.0) == pytest.approx(1.0 / 1.354, rel=1e-9)


def test_the_validity_ends_between_10_and_20_pa_m():
    assert law.law_reynolds(10.0) < 10.0 < law.law_reynolds(20.0)


class TestStatements:
    def test_none_of_those_that_were_found_holds_together(self):
        assert [each.title for each in statements() if each.verdict == "together"] == []

    def test_what_another_reading_reconciles_is_no_clash(self):
        """A shorter reservoir; a push from behind; a piston that goes with the gradient; walls that
        let the fluid through; grains cut by the cube."""
        told = [each.title for each in statements() if each.verdict == "open"]
        assert [title.split(",")[0] for title in told] == [
            "A piston that starts from rest",
            "A steady flow past the middle",
            "One piston for all gradients",
            "A closed specimen",
            "215 grains",
        ]

    def test_numbers_that_are_told(self):
        words = " ".join(each.words for each in statements())
        for told in (
            "99 s at 1",
            "17 s at 10",
            "at 1 and 2 Pa/m when",
            "fill 0.93 of the cube",
            "gone 107 of 205 mm at 10 s",
            "bring 28 × 10⁻⁶",
            "rises by a factor of 1.8",
        ):
            assert told in words

    @pytest.mark.parametrize(
        ("changes", "title"),
        [
            ({"specimen": {"solid_fraction": 0.93}}, "215 grains"),
            ({"piston": {"acceleration": 2e-6}}, "One piston"),
            ({"piston": {"acceleration": 1e-4}}, "A piston that starts from rest"),
            ({"piston": {"acceleration": 2e-6}}, "v_f = a t"),
            ({"specimen": {"length": 0.01}}, "A steady flow"),
        ],
    )
    def test_they_are_chosen_by_the_numbers(self, monkeypatch, changes, title):
        """As many grains as that; a piston hardly pushed; a specimen of a centimetre."""
        tables = law.example().model_dump(mode="json", exclude_none=True)
        for table, keys in changes.items():
            tables[table] |= keys
        changed = make_scene(tables)
        monkeypatch.setattr(law, "example", lambda: changed)
        found = next(each for each in statements() if each.title.startswith(title))
        assert found.verdict == "together"

    def test_the_same_share_of_the_pores_flows_at_each_gradient(self):
        """1.95e-7 and 1.97e-6 m3/s over 4.5e-3 m2 and the middle of the printed velocities."""
        drag = statements()[0]
        assert "the share that flows is 0.15 at 1 and 0.15 at 10 Pa/m" in drag.words
        assert drag.verdict == "clash"

    def test_slips(self):
        told = " ".join(slips())
        for part in ("3.0 % higher", "10 times the law's", "1.93 × 10⁻⁶", "Eq. 11"):
            assert part in told


def test_every_gradient_of_table_1_is_found():
    assert list(ROWS) == [1.0, 2.0, 5.0, 10.0, 20.0]
    assert ROWS[10.0].flow_m3_s("entrance") == 1.97e-6
    assert ROWS[20.0].flow_m3_s("middle") == 2.65e-6


def test_a_particle_that_enters_fast_gets_ahead():
    """By its relaxation time times the excess, were the drag that of Stokes; at free flight not."""
    free = law.free_flight_m_s(10.0)
    # The integrator's: a micrometre of 166 mm.
    assert law.carried_m(free, 10.0) == pytest.approx(0.0, abs=1e-6)
    # Eq. 18 is above Stokes' drag by f(Re), which is 3.3 to 9 here: so much shorter.
    stokes_s = 7000.0 * (4.0 / 3.0) * 3.14159 * 1.5e-3**3 / (6.0 * 3.14159 * 1e-3 * 1.5e-3)
    excess = 0.0214 - free
    assert excess * stokes_s / 9.0 < law.carried_m(0.0214, 10.0) < excess * stokes_s / 3.0
