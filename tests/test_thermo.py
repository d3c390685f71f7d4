"""The log reader, on recorded output of the engine and on every way to cut or garble it."""

from __future__ import annotations

import dataclasses
import math
import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from liggghts_driver.errors import ParseError
from liggghts_driver.results.thermo import Loop, Thermo, read_thermo

DATA = Path(__file__).parent / "data"
LOG = DATA / "thermo.log"
RANKS = DATA / "thermo_ranks.out"
FIRST_RUN = ["Step", "Atoms", "KinEng", "spin", "infinite", "undefine"]
LATER_RUNS = ["Time", "volume_e", "volume_e#2"]

needs_engine = pytest.mark.skipif(
    shutil.which("liggghts") is None, reason="liggghts is not installed"
)


@pytest.fixture(scope="module")
def scratch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("thermo") / "log"


def read(scratch: Path, text: str) -> Thermo:
    scratch.write_text(text, encoding="utf-8", newline="")
    return read_thermo(scratch)


def header(*names: str) -> str:
    return "".join(f"{n:>8} " if n in {"Step", "Atoms"} else f"{n:>14} " for n in names) + "\n"


def row(step: int, *values: float) -> str:
    return f"{step:8d} " + "".join(f"{value:14.8g} " for value in values) + "\n"


@pytest.mark.parametrize("path", [LOG, RANKS])
def test_rows_of_all_runs_are_joined(path):
    rows = read_thermo(path).rows
    assert list(rows) == FIRST_RUN + LATER_RUNS
    # Five runs print seventeen rows, of which four repeat the last of the run before.
    assert rows["Step"].tolist() == list(range(0, 1001, 100))
    assert rows["Atoms"].tolist()[:6] == [16, 16, 16, 15, 15, 15]
    # As printed, so exact.
    assert rows["KinEng"].tolist()[2:4] == [0.001130979, 5.0199175e-09]
    assert rows["Time"].tolist()[5:] == [0.005, 0.006, 0.007, 0.008, 0.009, 0.01]
    assert set(rows["volume_e"][5:]) == {2e-6}
    assert set(rows["volume_e#2"][5:]) == {3e-6}


def test_columns_are_nan_where_a_run_does_not_print_them():
    rows = read_thermo(LOG).rows
    # The row of step 500 ends one run and starts the next: it has the columns of both.
    assert rows.loc[:4, LATER_RUNS].isna().to_numpy().all()
    assert rows.loc[6:, FIRST_RUN[1:]].isna().to_numpy().all()
    assert rows.loc[5].drop("undefine").notna().all()


def test_columns_have_the_same_types_whatever_is_in_them(scratch):
    for rows in (read_thermo(LOG).rows, read(scratch, header("Step", "Atoms") + row(0, 1)).rows):
        assert rows.dtypes.pop("Step") == np.int64
        assert set(rows.dtypes.drop("Step")) == {np.dtype("float64")}


def test_infinite_and_undefined_values_are_values():
    rows = read_thermo(LOG).rows
    assert np.isposinf(rows["infinite"][:6]).all()
    assert rows["undefine"][:6].isna().all()


def test_loops_and_ranks():
    serial, parallel = read_thermo(LOG).loops, read_thermo(RANKS).loops
    assert [loop.steps for loop in serial] == [500, 100, 100, 100, 200]
    assert {loop.ranks for loop in serial} == {1}
    assert {loop.ranks for loop in parallel} == {2}
    assert serial[0] == Loop(seconds=0.000967184, ranks=1, steps=500, atoms=15)


def test_timing_is_summed_over_the_runs_that_print_it():
    thermo = read_thermo(LOG)
    assert list(thermo.timing_s) == ["Pair", "Neigh", "Comm", "Outpt", "Modfy", "Other"]
    # The parts of a run make up its loop time; the last run prints none. Six digits are printed.
    timed = sum(loop.seconds for loop in thermo.loops[:-1])
    assert math.isclose(sum(thermo.timing_s.values()), timed, rel_tol=1e-5)


def test_warnings_and_errors_are_kept():
    lost, renewed = read_thermo(RANKS).warnings
    assert lost == "WARNING: Lost atoms: original 15 current 15 (./src/thermo.cpp:454)"
    assert renewed.startswith("WARNING: New thermo_style command")
    assert read_thermo(RANKS).errors == ()

    failed = read_thermo(DATA / "thermo_error.log")
    assert failed.errors == (
        "ERROR: Sqrt of negative value in variable formula (./src/variable.cpp:2576)",
    )
    assert failed.rows["root"].tolist() == [12.247449, 7.0710678]
    assert failed.loops == ()


def test_an_empty_log_has_no_rows(scratch):
    thermo = read(scratch, "")
    assert thermo.rows.empty
    assert thermo.rows["Step"].dtype == np.int64
    assert (thermo.loops, dict(thermo.timing_s), thermo.truncated) == ((), {}, None)


def test_a_missing_log_is_a_parse_error(tmp_path):
    with pytest.raises(ParseError, match=r"nothing\.log"):
        read_thermo(tmp_path / "nothing.log")


def test_the_result_cannot_be_changed():
    thermo = read_thermo(LOG)
    with pytest.raises(dataclasses.FrozenInstanceError):
        thermo.truncated = "no"  # type: ignore[misc]
    with pytest.raises(TypeError):
        thermo.timing_s["Pair"] = 0.0  # type: ignore[index]


@pytest.mark.parametrize(
    "between",
    [
        "200 2.0\n",  # as from fix print: no space at the end
        'print "     200              2 "\n',
        "WARNING: Lost atoms: original 2 current 1\n",
        "     200            2.5\n",  # a row that was cut before something else followed
        "     200              2              3 \n",
        "     200              \n",
        "   200.5              2 \n",
        "     200       2.5-----\n",
        "Step x \n",  # a text, not a header: it is not aligned
        "    Step, then the rest \n",
        "    Step              y  \n",
        "    Step              y\n",
        "\n",
    ],
)
def test_only_rows_are_rows(scratch, between):
    text = header("Step", "x") + row(100, 1.5) + between + row(300, 3.5)
    rows = read(scratch, text).rows
    assert rows["Step"].tolist() == [100, 300]
    assert rows["x"].tolist() == [1.5, 3.5]


def test_rows_after_the_loop_time_belong_to_no_run(scratch):
    end = "Loop time of 1e-05 on 4 procs for 100 steps with 7 atoms, finish time now\n"
    thermo = read(scratch, header("Step", "x") + row(0, 1.0) + end + row(100, 2.0))
    assert thermo.rows["Step"].tolist() == [0]
    assert thermo.loops == (Loop(seconds=1e-5, ranks=4, steps=100, atoms=7),)


def test_the_row_at_a_boundary_is_kept_as_first_printed(scratch):
    head = header("Step", "CPU")
    rows = read(scratch, head + row(0, 0) + row(100, 9) + head + row(100, 0) + row(200, 8)).rows
    assert rows["Step"].tolist() == [0, 100, 200]
    assert rows["CPU"].tolist() == [0, 9, 8]


def test_steps_that_start_again_are_all_kept(scratch):
    head = header("Step", "x")
    rows = read(scratch, head + row(0, 1) + row(100, 2) + head + row(0, 3) + row(100, 4)).rows
    assert rows["x"].tolist() == [1, 2, 3, 4]


def test_a_number_that_was_cut_is_not_a_value(scratch):
    text = header("Step", "x") + row(0, 1.5) + row(100, 1.2345)
    for cut in range(1, 1 + len(row(100, 1.2345))):
        thermo = read(scratch, text[:-cut])
        assert thermo.rows["Step"].tolist() == [0]
        assert (thermo.truncated or "") == row(100, 1.2345)[:-cut]


@given(st.sampled_from([LOG, RANKS]), st.data())
def test_a_truncated_log_yields_only_rows_of_the_whole(scratch, path, data):
    text = path.read_text(encoding="utf-8")
    cut = text[: data.draw(st.integers(0, len(text)))]
    *lines, rest = cut.split("\n")
    thermo, whole = read(scratch, cut), read_thermo(path)
    assert thermo.truncated == (rest or None)
    # Nothing but what the whole log has at the same place, and all that was printed in full.
    printed = {line.split()[0] for line in lines if re.fullmatch(r" +\d+( +\S+)+ ", line)}
    assert len(thermo.rows) == len(printed)
    expected = whole.rows.loc[: len(printed) - 1, list(thermo.rows)]
    seen = thermo.rows.notna()
    pd.testing.assert_frame_equal(thermo.rows[seen], expected[seen])
    assert len(thermo.loops) == sum(line.startswith("Loop") for line in lines)
    assert thermo.loops == whole.loops[: len(thermo.loops)]
    assert set(thermo.warnings) <= set(whole.warnings)


@given(st.text(alphabet="Step Atoms0123456789.e+-\n%()=naif:", max_size=400))
def test_no_text_makes_the_reader_fail(scratch, text):
    read(scratch, header("Step", "x") + text)


def test_bytes_that_are_no_text_do_not_matter(scratch):
    scratch.write_bytes(b"\xff\xfe\n" + (header("Step", "x") + row(0, 1.5)).encode() + b"\xff")
    assert read_thermo(scratch).rows["x"].tolist() == [1.5]


@pytest.mark.engine
@needs_engine
@pytest.mark.parametrize("ranks", [1, 2])
def test_the_engine_still_writes_what_was_recorded(tmp_path, ranks):
    command = ["stdbuf", "-oL", "liggghts", "-in", str(DATA / "recorded.in")]
    if ranks > 1:
        if shutil.which("mpirun") is None:
            pytest.skip("mpirun is not installed")
        command = ["mpirun", "--bind-to", "none", "-np", str(ranks), *command]
    allowed = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    subprocess.run(
        command, cwd=tmp_path, env=os.environ | allowed, check=True, capture_output=True, timeout=60
    )
    now = read_thermo(tmp_path / "log.liggghts")
    # Eight digits are printed, of which another build or machine may round the last differently.
    pd.testing.assert_frame_equal(now.rows, read_thermo(LOG).rows, rtol=2e-7)
    assert [loop.ranks for loop in now.loops] == [ranks] * 5
