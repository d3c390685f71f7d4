"""The engine's series read back: whole rows only, our columns, the start put in front."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from small_scenes import COLLISION, INFILTRATION, case_of

from liggghts_driver.errors import ParseError
from liggghts_driver.results.series import complete_series, read_series

HEAD = "step kinetic_energy_j largest_speed_m_s\n"
SPECIMEN_COLUMNS = [
    "step", "kinetic_energy_j", "largest_speed_m_s", "inside", "flowing", "flow_velocity_sum_m_s",
    "volume_past_entrance_m3", "volume_past_middle_m3", "piston_x_m", "piston_force_n",
    "largest_reynolds_squared",
]  # fmt: skip


@pytest.fixture
def file(tmp_path):
    return tmp_path / "series.txt"


class TestRead:
    def test_rows(self, file):
        # As the engine prints: twenty digits.
        file.write_text(HEAD + "14 1.0959833972259480e-09 0.005\n28 0 -inf\n")
        table = read_series(file)
        assert table.columns.tolist() == HEAD.split()
        assert table["step"].tolist() == [14, 28]
        assert table["step"].dtype == np.int64
        assert table["kinetic_energy_j"].tolist() == [1.0959833972259480e-09, 0.0]
        assert table["largest_speed_m_s"].tolist() == [0.005, -math.inf]

    def test_the_largest_of_no_particles_is_nothing(self, file):
        """The engine begins its search for the largest with -1e20."""
        file.write_text(HEAD + "14 0 -1e+20\n28 -1e+20 -1e20\n")
        table = read_series(file)
        assert table["largest_speed_m_s"].tolist() == [0.0, 0.0]
        assert table["kinetic_energy_j"].tolist() == [0.0, -1e20]  # a sum is what it is

    @given(st.integers(0, 120))
    @settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
    def test_cut_anywhere_only_whole_rows_count(self, file, length):
        text = HEAD + "".join(f"{n} {n}.5 {n}e-3\n" for n in range(10, 15))
        cut = text[:length]
        file.write_text(cut)
        rows = cut.count("\n") - 1
        if rows < 0:
            with pytest.raises(ParseError, match="empty"):
                read_series(file)
            return
        assert read_series(file)["step"].tolist() == list(range(10, 10 + rows))

    def test_no_rows_yet(self, file):
        file.write_text(HEAD)
        assert read_series(file).empty
        assert read_series(file).columns.tolist() == HEAD.split()

    @pytest.mark.parametrize(
        ("row", "words"),
        [
            ("1 2\n", "line 3: expected 3 numbers, found 2"),
            ("1 2 3 4\n", "line 3: expected 3 numbers, found 4"),
            ("1 two 3\n", "line 3: expected 3 numbers, found '1 two 3'"),
            ("\n", "line 3: expected 3 numbers, found 0"),
        ],
    )
    def test_a_whole_row_that_is_none_is_named(self, file, row, words):
        file.write_text(HEAD + "0 0 0\n" + row)
        with pytest.raises(ParseError) as caught:
            read_series(file)
        assert words in str(caught.value)
        assert str(file) in str(caught.value)

    def test_no_file(self, file):
        with pytest.raises(ParseError, match="wrote no series"):
            read_series(file)

    @pytest.mark.parametrize(
        "content",
        [
            HEAD.encode() + b"\xff\xfe\x00\n",
            HEAD.encode() + b"1.5 0 0\n",
            HEAD.encode() + b"nan 0 0\n",
            b"time speed\n0 0\n",
            b"step step\n0 0\n",
        ],
    )
    def test_garbage_is_a_parse_error(self, file, content):
        file.write_bytes(content)
        with pytest.raises(ParseError):
            read_series(file)


@pytest.fixture(scope="module")
def case():
    return case_of(INFILTRATION)


@pytest.fixture
def raw(case):
    """Two rows: one particle through the entrance, then both sections passed by some."""
    every = case.time.sample_every
    rows = [
        [every, 1.0, 0.1, 1, 0, 0.0, 2e-8, 0.0, -0.0299, -1e-3, 4.0],
        [2 * every, 2.0, 0.2, 2, 2, 0.01, 5e-8, 1e-8, -0.0298, 0.0, 9.0],
    ]
    return pd.DataFrame(rows, columns=SPECIMEN_COLUMNS).astype({"step": np.int64})


class TestComplete:
    def test_columns(self, case, raw):
        table = complete_series(raw, case)
        assert table.columns.tolist() == [
            "step", "time_s", "kinetic_energy_j", "largest_speed_m_s", "inside", "flowing",
            "piston_x_m", "piston_force_n", "volume_entrance_m3", "volume_middle_m3",
            "flowing_velocity_m_s", "largest_reynolds",
        ]  # fmt: skip

    def test_values(self, case, raw):
        table = complete_series(raw, case)
        assert table["step"].tolist() == [0, case.time.sample_every, 2 * case.time.sample_every]
        assert table["time_s"].tolist() == (table["step"] * case.time.step_s).tolist()
        # No particle is inside the specimen at the start.
        assert table["volume_entrance_m3"].tolist() == [0.0, 2e-8, 5e-8]
        assert table["volume_middle_m3"].tolist() == [0.0, 0.0, 1e-8]
        assert table["largest_reynolds"].tolist() == [0.0, 2.0, 3.0]
        velocity = table["flowing_velocity_m_s"]
        assert velocity.isna().tolist() == [True, True, False]
        assert velocity.iloc[2] == 0.005
        assert table["piston_x_m"].tolist() == [-0.03, -0.0299, -0.0298]

    def test_what_is_past_a_section_at_the_start_has_not_passed_it(self, raw):
        inside = {"radius": 0.0005, "position": [0.005, 0.0, 0.0]}
        case = case_of(INFILTRATION, {"spheres": [inside]})
        volume = 4 / 3 * math.pi * 0.0005**3
        raw["volume_past_entrance_m3"] += volume
        table = complete_series(raw, case)
        # Sums of volumes of 1e-8 m3 round in their last digits.
        assert table["volume_entrance_m3"].tolist() == pytest.approx([0, 2e-8, 5e-8], abs=1e-22)

    def test_what_is_asked_is_not_changed(self, case, raw):
        before = raw.copy()
        complete_series(raw, case)
        pd.testing.assert_frame_equal(raw, before)

    def test_the_start_is_that_of_the_population(self):
        case = case_of(COLLISION)
        raw = pd.DataFrame([[43, 1.0, 1.0]], columns=HEAD.split()).astype({"step": np.int64})
        first = complete_series(raw, case).iloc[0]
        assert first["largest_speed_m_s"] == pytest.approx(0.005, rel=1e-14)
        mass = 7000.0 * 4 / 3 * math.pi * 0.0015**3
        assert first["kinetic_energy_j"] == pytest.approx(mass * 0.005**2, rel=1e-12)

    def test_the_start_has_its_reynolds_number(self):
        case = case_of(COLLISION, {"fluid": {"density": 2000.0, "viscosity": 0.001}})
        columns = [*HEAD.split(), "largest_reynolds_squared"]
        raw = pd.DataFrame([[43, 1.0, 1.0, 4.0]], columns=columns).astype({"step": np.int64})
        first = complete_series(raw, case).iloc[0]
        assert first["largest_reynolds"] == pytest.approx(2 * 2000 * 0.0015 * 0.005 / 0.001)
