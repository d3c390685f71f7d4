from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from report_answers import collision, infiltration
from small_scenes import COLLISION, case_of

from liggghts_driver.deck.particles import simulation_box
from liggghts_driver.report.camera import side_view
from liggghts_driver.report.snapshots import common_edges, snapshots
from liggghts_driver.rundir import RunDirectory

RECORDED = Path(__file__).parent / "data" / "report"
#: The scene that the recorded snapshot shows: nothing in it is symmetric.
SPHERES = [
    {"radius": 0.002, "position": [-0.01, 0.0, 0.003]},
    {"radius": 0.0015, "position": [0.02, 0.0, -0.001]},
]
RECORDED_SCENE = {
    "box.low": [-0.02, -0.005, -0.004],
    "box.high": [0.03, 0.005, 0.008],
    "spheres": SPHERES,
}
VERMILION, GREY = (0xD5, 0x5E, 0x00), (0x6B, 0x6B, 0x6B)


def blank_run(folder, width, height, zoom, steps=(0,), modify=""):
    """A run directory with white snapshots and a deck that says how they are seen."""
    directory = RunDirectory(folder)
    directory.dumps.mkdir()
    directory.deck.write_text(
        f"dump images all image 10 dumps/s.*.ppm type diameter size {width} {height} "
        f"view 90 270 zoom {zoom} box no 0.0\ndump_modify images pad 10 {modify}\n"
    )
    for step in steps:
        Image.new("RGB", (width, height), "white").save(
            directory.dumps / f"snapshot.{step:010d}.ppm"
        )
    return directory


def pixels(picture):
    with Image.open(io.BytesIO(picture.png)) as image:
        return np.asarray(image.convert("RGB"))


def test_the_camera_finds_the_spheres_on_a_recorded_snapshot():
    camera = side_view((RECORDED / "deck.in").read_text(), case_of(COLLISION, RECORDED_SCENE))
    with Image.open(RECORDED / "snapshot.0000000000.ppm") as image:
        seen = (np.asarray(image) != 255).any(axis=2)
    for sphere in SPHERES:
        x, _, z = sphere["position"]
        column, row = camera.column(x), camera.row(z)
        radius = sphere["radius"] / camera.pixel_m
        around = slice(int(row - radius - 3), int(row + radius + 4))
        across = slice(int(column - radius - 3), int(column + radius + 4))
        rows, columns = np.nonzero(seen[around, across])
        rows, columns = rows + 0.5 + around.start, columns + 0.5 + across.start
        # A pixel is drawn when its centre is inside: the outermost are up to one pixel inside.
        for extreme, expected in (
            (columns.min(), column - radius),
            (columns.max(), column + radius),
            (rows.min(), row - radius),
            (rows.max(), row + radius),
        ):
            assert abs(extreme - expected) < 1.0
        # The middle of them all is that of the sphere to half a pixel of the grid.
        assert abs(columns.mean() - column) < 0.25
        assert abs(rows.mean() - row) < 0.25


@pytest.mark.parametrize("view", ["view 60 30 zoom 1", "view 90 270 zoom 1 center s 0 0 0"])
def test_another_view_has_no_camera(view):
    deck = f"dump images all image 10 s.*.ppm type diameter size 100 50 {view} box no 0.0\n"
    assert side_view(deck, collision()[0]) is None


def test_a_part_of_a_view_shows_the_same_places():
    camera = side_view((RECORDED / "deck.in").read_text(), case_of(COLLISION, RECORDED_SCENE))
    part = camera.cut(left=30, top=8, scale=0.5)
    assert part.column(0.01) == pytest.approx((camera.column(0.01) - 30) * 0.5)
    assert part.row(0.002) == pytest.approx((camera.row(0.002) - 8) * 0.5)


def test_the_piston_is_drawn_where_it_is_at_each_step(tmp_path):
    case, answer = infiltration()
    box = simulation_box(case)
    length, height = (high - low for low, high in (box[0], box[2]))
    rows = round(600 * height / length)
    zoom = 2 * max(high - low for low, high in box) * 600 / (rows * length)  # as wide as the box
    steps = answer.series["step"].iloc[[0, 20, 40]]
    seen = snapshots(case, answer, blank_run(tmp_path, 600, rows, zoom, steps))
    assert list(seen.legend) == ["walls", "faces of the specimen", "piston"]
    places = []
    for picture in seen.pictures:
        columns = np.nonzero((pixels(picture) == VERMILION).all(axis=2).any(axis=0))[0]
        places.append(columns.mean())
    moved = np.diff(answer.series["piston_x_m"].iloc[[0, 20, 40]]) / (length / 600)
    # Either place is rounded to a pixel.
    np.testing.assert_allclose(np.diff(places), moved, atol=1.0)
    # 0.02 m of specimen and 0.03 m of reservoir: its distance from the walls tells the place.
    walls = np.nonzero((pixels(seen.pictures[0]) == GREY).all(axis=2).any(axis=0))[0]
    assert walls.max() - places[0] == pytest.approx(0.05 / (length / 600), abs=2.0)


def test_times_stand_under_the_snapshots(tmp_path):
    case, answer = infiltration()
    steps = answer.series["step"].iloc[[0, 20]]
    seen = snapshots(case, answer, blank_run(tmp_path, 300, 100, 3.0, steps))
    assert [picture.caption for picture in seen.pictures] == ["t = 0 s", "t = 0.500 s"]


def test_open_faces_and_walls_are_told_apart(tmp_path):
    _, answer = collision()
    case = case_of(COLLISION, {"box.walls": ["z-"]})
    seen = snapshots(case, answer, blank_run(tmp_path, 300, 100, 3.0))
    assert list(seen.legend) == ["walls", "open faces"]


@pytest.mark.parametrize(
    ("modify", "halved"), [("backcolor white thresh y >= 0.0", True), ("", False)]
)
def test_a_halved_view_says_so(tmp_path, modify, halved):
    seen = snapshots(*collision(), blank_run(tmp_path, 300, 100, 3.0, modify=modify))
    assert ("left out" in seen.note) == halved


def test_an_unknown_view_is_shown_without_lines(tmp_path):
    directory = blank_run(tmp_path, 300, 100, 3.0)
    directory.deck.write_text("")
    seen = snapshots(*collision(), directory)
    assert (seen.note, seen.legend) == ("", {})
    assert (pixels(seen.pictures[0]) == 255).all()


def test_no_snapshots_are_no_pictures(tmp_path):
    seen = snapshots(*collision(), blank_run(tmp_path, 300, 100, 3.0, steps=()))
    assert seen.pictures == ()


def test_common_edges_hold_what_any_image_shows():
    images = [Image.new("RGB", (200, 100), "white") for _ in range(3)]
    images[0].putpixel((60, 40), (0, 0, 0))
    images[2].putpixel((90, 50), (250, 255, 255))
    assert common_edges(images, []) == (50, 30, 101, 61)  # ten pixels of room
    assert common_edges(images, [(5, 45, 195, 47)]) == (0, 30, 200, 61)
    assert common_edges(images[1:2], []) == (0, 0, 200, 100)
