"""The dump readers, on recorded output of the engine and on every way to cut or garble it."""

from __future__ import annotations

import contextlib
import os
import shutil
import struct
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from liggghts_driver.errors import ParseError
from liggghts_driver.results.binarydump import iter_binary_frames
from liggghts_driver.results.textdump import iter_text_frames

if TYPE_CHECKING:
    from liggghts_driver.results.frames import Frame, FrameReader, Paths

DATA = Path(__file__).parent / "data"
TEXT = DATA / "dump.txt"
BINARY = DATA / "dump.bin"
COLUMNS = ("id", "type", "x", "y", "z", "vx", "vy", "vz", "radius")
STEPS = [0, 200, 400, 600, 800, 1000]
COUNTS = [16, 16, 15, 15, 15, 15]  # one sphere leaves the box

needs_engine = pytest.mark.skipif(
    shutil.which("liggghts") is None, reason="liggghts is not installed"
)


def read_binary(paths: Paths) -> FrameReader:
    return iter_binary_frames(paths, COLUMNS)


READERS = {TEXT: iter_text_frames, BINARY: read_binary}
RECORDED = {path: list(read(path)) for path, read in READERS.items()}
both = pytest.mark.parametrize(("path", "read"), READERS.items(), ids=["text", "binary"])


@pytest.fixture(scope="module")
def scratch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("dumps") / "dump"


def frame_starts(content: bytes) -> list[int]:
    """Where the frames of a recorded dump begin, found without the readers."""
    if content.startswith(b"ITEM"):
        return [k for k in range(len(content)) if content.startswith(b"ITEM: TIMESTEP", k)]
    sizes = [100 + 4 + 72 * count for count in COUNTS]  # header, size of the one block, particles
    return [sum(sizes[:k]) for k in range(len(sizes))]


@both
def test_recorded_frames(path, read):
    frames = list(read(path))
    assert [frame.step for frame in frames] == STEPS
    assert [len(frame.data) for frame in frames] == COUNTS
    for frame in frames:
        assert tuple(frame.data) == COLUMNS
        assert frame.box.tolist() == [[0, 0.1], [0, 0.05], [0, 0.05]]
        assert frame.data.dtypes.tolist() == [np.int64] * 2 + [np.float64] * 7
    # The second sphere's line of step 1000, as the engine printed it.
    second = frames[-1].sorted_by_id().data.iloc[0]
    expected = [2, 1, 0.03998, 0.0199995, 0.02, -0.002, -5.36573e-05, 0, 0.0015]
    # The text holds six digits.
    np.testing.assert_allclose(second.to_numpy(), expected, rtol=5e-6)


@pytest.mark.parametrize("suffix", ["", "_ranks"])
def test_text_and_binary_dumps_of_a_run_agree(suffix):
    texts = iter_text_frames(DATA / f"dump{suffix}.txt")
    binaries = read_binary(DATA / f"dump{suffix}.bin")
    for text, binary in zip(texts, binaries, strict=True):
        assert text.step == binary.step
        # The text has six digits, so half a unit of the sixth.
        pd.testing.assert_frame_equal(text.data, binary.data, rtol=5e-6, atol=0)


@both
def test_two_ranks_write_the_same_particles(path, read):
    # Each rank writes a block. They number their particles by themselves: compare by place.
    for alone, shared in zip(RECORDED[path], read(path.with_stem("dump_ranks")), strict=True):
        # Free flight: no sum depends on the order of the particles, so all is the same bit by bit.
        pd.testing.assert_frame_equal(by_place(alone), by_place(shared))


def by_place(frame: Frame) -> pd.DataFrame:
    return frame.data.drop(columns="id").sort_values(["x", "y", "z"], ignore_index=True)


@both
def test_sorting_by_id_keeps_every_row_together(path, read):
    for frame in read(path):
        ordered = frame.sorted_by_id()
        assert (ordered.step, ordered.box.tolist()) == (frame.step, frame.box.tolist())
        assert ordered.data.index.equals(frame.data.index)
        expected = frame.data.sort_values("id", ignore_index=True)
        pd.testing.assert_frame_equal(ordered.data, expected)
    # After the loss of the first sphere the engine moved the last one into its place, for a while.
    assert RECORDED[path][2].data["id"].tolist() == [16, *range(2, 16)]


@both
def test_one_file_per_frame_is_the_same_as_one_file(tmp_path, path, read):
    content = path.read_bytes()
    starts = [*frame_starts(content), len(content)]
    files = [tmp_path / f"frame.{step}" for step in STEPS]
    for file, begin, end in zip(files, starts[:-1], starts[1:], strict=True):
        file.write_bytes(content[begin:end])
    for one, many in zip(RECORDED[path], read(files), strict=True):
        assert one.step == many.step
        pd.testing.assert_frame_equal(one.data, many.data)


@both
def test_columns_can_be_used_as_any_others(path, read):
    (frame, *_) = read(path)
    frame.data["x"] += 1.0
    frame.data.loc[0, "vy"] = 2.0
    assert frame.data["x"].min() > 1.0
    assert frame.data["vy"].iloc[0] == 2.0


@both
@settings(max_examples=60)
@given(data=st.data())
def test_a_truncated_dump_yields_only_frames_of_the_whole(scratch, path, read, data):
    content = path.read_bytes()
    starts = frame_starts(content)
    cut = data.draw(st.integers(0, len(content)) | st.sampled_from(starts))
    scratch.write_bytes(content[:cut])
    reader = read(scratch)
    frames = list(reader)
    for frame, expected in zip(frames, RECORDED[path], strict=False):
        assert frame.step == expected.step
        pd.testing.assert_frame_equal(frame.data, expected.data)
    complete = [end for end in [*starts[1:], len(content)] if end <= cut]
    assert len(frames) == len(complete)
    assert (reader.truncated is None) == (cut in complete)


@both
@settings(max_examples=60)
@given(data=st.data())
def test_garbled_dumps_end_in_parse_errors_at_worst(scratch, path, read, data):
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at] = data.draw(st.sampled_from(b"0123456789.-+e \nIx") | st.integers(0, 255))
    scratch.write_bytes(content)
    with contextlib.suppress(ParseError):
        assert len(list(read(scratch))) <= len(STEPS)


@both
def test_where_a_dump_is_cut_is_told(scratch, path, read):
    content = path.read_bytes()
    begin = frame_starts(content)[2]
    scratch.write_bytes(content[: begin + 300])
    reader = read(scratch)
    assert [frame.step for frame in reader] == STEPS[:2]
    assert reader.truncated is not None
    assert reader.truncated.path == scratch
    line = content[:begin].count(b"\n") + 1
    assert reader.truncated.where == (f"line {line}" if path is TEXT else f"byte {begin}")
    assert "missing" in str(reader.truncated)
    assert list(reader) == []
    assert reader.truncated is not None


@both
def test_an_empty_file_is_a_missing_frame(scratch, path, read):
    scratch.write_bytes(b"")
    reader = read([path, scratch])
    assert len(list(reader)) == len(STEPS)
    assert reader.truncated is not None
    assert reader.truncated.path == scratch


@both
def test_only_the_last_file_may_be_cut(scratch, path, read):
    scratch.write_bytes(path.read_bytes()[:-1])
    reader = read([scratch, path])
    with pytest.raises(ParseError, match="though another file follows"):
        list(reader)


@both
def test_files_that_cannot_be_read_are_parse_errors(tmp_path, path, read):
    with pytest.raises(ParseError, match="nothing"):
        list(read(tmp_path / "nothing"))
    with pytest.raises(ParseError):
        list(read(tmp_path))
    assert list(read([])) == []


@both
def test_another_format_is_refused(path, read):
    other = TEXT if path is BINARY else BINARY
    with pytest.raises(ParseError):
        list(read(other))


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("ITEM: TIMESTEP\n200", "ITEM: TIMESTAMP\n200", 26, "'ITEM: TIMESTEP'"),
        ("200\n", "2x0\n", 27, "whole number"),
        ("200\n", "-200\n", 27, "whole number"),
        ("ITEM: NUMBER", "ITEM: NO", 3, "'ITEM: NUMBER OF ATOMS'"),
        ("16\n", "15\n", 25, "end after 15 lines"),
        ("16\n", "17\n", 26, "1 of 17 lines"),
        ("BOUNDS ff", "BOUNDS xy xz yz ff", 5, "orthogonal"),
        ("0 0.1\n", "0 0.1 0\n", 6, "bound"),
        ("16\n", "99999999999999\n", 26, "99999999999983 of 99999999999999 lines"),
        ("16\n", "9" * 5000 + "\n", 4, "whole number"),
        ("ITEM: ATOMS id", "ITEM: ATOMS", 10, "expected 8 numbers"),
        ("id type x y z vx vy vz radius \n", "\n", 9, "names of the columns"),
        ("id type x", "id type id", 9, "different names"),
        ("1 1 0.02 ", "1 1.5 0.02 ", 9, "whole numbers in column 'type'"),
        ("1 1 0.02 ", "1 nan 0.02 ", 9, "whole numbers in column 'type'"),
        ("\n3 1 0.06 ", "\n3 1 0.0.6 ", 12, "expected a number"),
        ("\n3 1 0.06 ", "\n3 1 ", 12, "expected 9 numbers"),
    ],
)
def test_faults_in_a_text_dump_name_file_line_and_what_was_expected(
    scratch, old, new, line, message
):
    scratch.write_text(TEXT.read_text().replace(old, new, 1))
    with pytest.raises(ParseError, match=message) as caught:
        list(iter_text_frames(scratch))
    assert str(caught.value).startswith(f"{scratch}:{line}: ")


@pytest.mark.parametrize(
    ("offset", "value", "message"),
    [
        (0, struct.pack("<q", -1), "header"),
        (8, struct.pack("<q", 15), "at most 135 numbers"),
        (8, struct.pack("<q", 17), "expected 153 numbers in 1 blocks, found 144"),
        (8, struct.pack("<q", 2**60), "found 144"),
        (16, struct.pack("<i", 1), "orthogonal"),
        (92, struct.pack("<i", 8), "expected 9 columns"),
        (92, struct.pack("<i", 0), "header"),
        (96, struct.pack("<i", 0), "header"),
        (100, struct.pack("<i", -1), "found -1"),
        (104, struct.pack("<d", 1.5), "whole numbers in column 'id'"),
    ],
)
def test_faults_in_a_binary_dump_name_file_byte_and_what_was_expected(
    scratch, offset, value, message
):
    content = bytearray(BINARY.read_bytes())
    begin = frame_starts(content)[1]
    content[begin + offset : begin + offset + len(value)] = value
    scratch.write_bytes(content)
    with pytest.raises(ParseError, match=message) as caught:
        list(read_binary(scratch))
    assert str(caught.value).startswith(f"{scratch}: frame at byte {begin}: ")


def test_the_number_of_columns_must_be_that_of_the_file():
    with pytest.raises(ParseError, match=r"expected 2 columns \(id x\), found 9"):
        list(iter_binary_frames(BINARY, ["id", "x"]))
    with pytest.raises(ParseError, match="different names"):
        list(iter_binary_frames(BINARY, ["id"] * 9))


def test_frames_without_particles(scratch):
    head = TEXT.read_bytes().partition(b"16\n")[0]
    tail = b"ITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\nITEM: ATOMS id x \n"
    scratch.write_bytes((head + b"0\n" + tail) * 2)
    reader = iter_text_frames(scratch)
    assert [len(frame.data) for frame in reader] == [0, 0]
    assert reader.truncated is None

    header = struct.pack("<qqi6i6dii", 7, 0, 0, *[1] * 6, *[0, 1] * 3, 9, 2)
    scratch.write_bytes((header + struct.pack("<ii", 0, 0)) * 2)
    reader = read_binary(scratch)
    assert [len(frame.data) for frame in reader] == [0, 0]
    assert reader.truncated is None


def test_frames_larger_than_the_pieces_in_which_text_is_read(scratch):
    head = TEXT.read_bytes().partition(b"16\n")[0]
    middle = b"ITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\nITEM: ATOMS id x y \n"
    rows = 40_000
    lines = b"".join(b"%d 0.%d -1.5e-%02d \n" % (k, k, k % 18) for k in range(rows))
    scratch.write_bytes((head + b"%d\n" % rows + middle + lines) * 2)
    frames = list(iter_text_frames(scratch))
    assert len(frames) == 2
    for frame in frames:
        assert frame.data["id"].tolist() == list(range(rows))
        assert frame.data["x"].tolist() == [float(f"0.{k}") for k in range(rows)]
        assert frame.data["y"].tolist() == [float(f"-1.5e-{k % 18:02d}") for k in range(rows)]


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
    for path, read in READERS.items():
        for now, recorded in zip(read(tmp_path / path.name), RECORDED[path], strict=True):
            assert now.step == recorded.step
            # Six digits are printed; another machine may round the last of them differently.
            pd.testing.assert_frame_equal(by_place(now), by_place(recorded), rtol=2e-5)
