from __future__ import annotations

import base64
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from report_answers import SAMPLES, collision, infiltration

from liggghts_driver.errors import ParseError
from liggghts_driver.report.page import render_page
from liggghts_driver.report.picture import Picture
from liggghts_driver.report.snapshots import Snapshots
from liggghts_driver.report.write import write_report
from liggghts_driver.rundir import RunDirectory

VOID = {"meta", "img"}
DECK = '# a deck\nvariable v atom "(x<1)&&(y>2)"\n'
SIDE_VIEW = "dump images all image 9 s.*.ppm type diameter size 40 20 view 90 270 zoom 3.0\n"
ONE_SNAPSHOT = b"P6\n40 20\n255\n" + b"\xff" * 40 * 20 * 3


class Page(HTMLParser):
    """A page as a browser takes it: text and numbers by section, every element closed."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.html = html
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str]] = []
        self.values: list[str] = []
        self.texts: dict[str, str] = {}  # by element
        self.sections: dict[str, str] = {}  # texts without their headings
        self._open: list[str] = []
        self._section = ""
        self.feed(html)
        self.close()
        assert not self._open, "elements that are never closed"

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(name, value or "") for name, value in attrs]
        if tag == "data":
            self.values.append(dict(attrs)["value"])
        if tag not in VOID:
            self._open.append(tag)
        if tag == "img":
            self.sections[self._section] = self.sections.get(self._section, "") + "[img]"

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, text):
        for tag in set(self._open):
            self.texts[tag] = self.texts.get(tag, "") + text
        if self._open and self._open[-1] == "h2":
            self._section = text
            self.sections[text] = ""
        elif self._section:
            self.sections[self._section] += text.strip()


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The report of an infiltration as it is written, with its run directory."""
    case, answer = infiltration()
    directory = RunDirectory(tmp_path_factory.mktemp("run"))
    directory.dumps.mkdir()
    directory.deck.write_text(DECK)
    (directory.dumps / "snapshot.0000000000.ppm").write_bytes(ONE_SNAPSHOT)
    write_report(case, answer, directory)
    return answer, directory, Page(directory.report.read_text(encoding="utf-8"))


def page_of(case, answer):
    """The page without its pictures: much quicker."""
    names = ("volume", "velocity", "piston") if case.scene.specimen else ("motion",)
    figures = [Picture(name, b"", name, name) for name in names]
    return Page(render_page(case, answer, DECK, figures, Snapshots((), "", {})))


def test_an_infiltration_has_its_sections_in_order_and_none_is_empty(written):
    _, _, page = written
    assert list(page.sections) == [
        "Flow through the specimen",
        "Snapshots",
        "Piston",
        "The run in numbers",
        "Effects",
        "Scene and deck",
        "Provenance",
    ]
    assert all(page.sections.values())


def test_a_scene_without_a_specimen_has_no_empty_section():
    page = page_of(*collision())
    assert list(page.sections) == [
        "Exact answers",
        "Motion",
        "The run in numbers",
        "Effects",
        "Scene and deck",
        "Provenance",
    ]
    assert all(page.sections.values())
    assert page.tags.count("img") == 1
    assert [float(v) for v in page.values if v] == [0.0, 0.0, 0.7079, 0.7074, 1.000707]


@pytest.mark.parametrize(
    ("verdict", "word"), [("valid", "Valid"), ("not_steady", "Not steady"), ("invalid", "Invalid")]
)
def test_the_verdict_comes_first_in_words_with_its_reasons(verdict, word):
    case, answer = infiltration()
    answer.results.update(verdict=verdict, reasons=["it is <so>", "and so"])
    page = page_of(case, answer)
    assert page.texts["strong"] == word
    assert page.texts["title"] == f"{word}: A made-up run"
    assert ("class", f"verdict {verdict}") in page.attributes
    assert "it is <so>" in page.texts["header"]
    assert "and so" in page.texts["header"]
    assert page.html.index("</header>") < page.html.index("<h2>")


def test_every_compared_number_is_that_of_the_results(written):
    answer, _, page = written
    expected = []
    parts = {
        name: section["particle_flow_rate_m3_s"]
        for name, section in answer.results["sections"].items()
    }
    parts["flowing_velocity"] = answer.results["flowing_velocity_m_s"]
    for name, part in parts.items():
        pair = answer.results["comparison"][name]
        expected += [part["mean"], part["ci95"], pair["estimated"], pair["ratio"], pair["z_score"]]
    assert [float(value) for value in page.values] == expected  # exactly: written in full


def test_numbers_are_shown_with_their_units_to_the_digits_of_their_errors(written):
    _, _, page = written
    flow = page.sections["Flow through the specimen"]
    assert "Particle flow rate, entrance[cm³/s]0.679± 0.067" in flow
    assert "Mean velocity of the flowing particles[mm/s]1.65± 0.10" in flow
    numbers = page.sections["The run in numbers"]
    assert "Solid fraction measured0.299" in numbers
    assert "Largest overlap0.12 % of the smaller radius" in numbers
    assert "12.5 s on 2 processes" in numbers
    assert "Placing the spheres0.250 s" in numbers


def test_unknown_numbers_are_dashes():
    case, answer = infiltration()
    answer.results["sections"]["entrance"]["particle_flow_rate_m3_s"]["ci95"] = None
    answer.results["comparison"]["entrance"]["z_score"] = None
    page = page_of(case, answer)
    assert page.values.count("") == 2
    assert page.sections["Flow through the specimen"].count("–") == 3  # and one in "Eqs. 1–16"
    assert not re.search(r"\b(None|nan|inf)\b", page.html)


@pytest.mark.parametrize("broken", [np.nan, np.inf])
@pytest.mark.parametrize("make", [infiltration, collision])
def test_a_run_that_failed_numerically_is_reported_too(make, broken, tmp_path):
    case, answer = make()
    numbers = answer.series.columns.difference(["step", "time_s"])
    answer.series.loc[SAMPLES // 2 :, numbers] = broken
    answer.results.update(largest_speed_m_s=None, max_overlap_over_radius=None)
    for check in answer.results["exact"]:
        check.update(simulated=None, ratio=None)
    directory = RunDirectory(tmp_path)
    directory.dumps.mkdir()
    directory.deck.write_text(SIDE_VIEW)
    (directory.dumps / f"snapshot.{case.time.steps:010d}.ppm").write_bytes(ONE_SNAPSHOT)
    write_report(case, answer, directory)
    page = Page(directory.report.read_text(encoding="utf-8"))
    assert "Largest overlap– %" in page.sections["The run in numbers"]
    assert not re.search(r"\b(None|nan|inf)\b", page.html)


def test_a_mean_that_is_not_steady_says_so():
    case, answer = infiltration()
    answer.results["flowing_velocity_m_s"] |= {"steady": False, "reason": "drifts"}
    flow = page_of(case, answer).sections["Flow through the specimen"]
    assert "Mean velocity of the flowing particles[mm/s]not steady" in flow
    assert "Mean velocity of the flowing particles, 0.400 to 1.00 s: drifts." in flow
    assert "Particle flow rate, entrance[cm³/s]0.679" in flow


def test_warnings_of_the_estimate_are_shown():
    case, answer = infiltration()
    answer.results["comparison"]["estimate_warnings"] = ["Re is 15 & above 10"]
    assert "The estimate: Re is 15 & above 10" in page_of(case, answer).texts["main"]


def test_without_an_estimate_its_columns_are_left_out_and_the_reason_is_given():
    case, answer = infiltration()
    answer.results["estimate"] = {"applies": False, "reason": "pressure.gradient (missing)"}
    answer.results["comparison"] = {}
    page = page_of(case, answer)
    assert "No estimate: pressure.gradient (missing)." in page.sections["Flow through the specimen"]
    assert "z-score" not in page.texts["main"]


def test_effects_are_in_or_out_with_their_reasons():
    case, answer = infiltration({"contact.friction": 0.25})
    effects = page_of(case, answer).sections["Effects"]
    assert "tangential frictioninfriction coefficient 0.25" in effects
    assert "gravityoutthe scene has no [gravity]" in effects


@pytest.mark.parametrize(
    "title", ["<script>alert(1)</script>", "</title><img src=x>", "$x_{ & \"'"]
)
def test_a_malicious_title_is_text(title):
    case, answer = infiltration({"title": title})
    answer.results["title"] = title
    page = page_of(case, answer)
    assert "script" not in page.tags
    assert page.tags.count("img") == 3
    assert page.texts["h1"] == title


def test_the_deck_is_shown_as_it_is(written):
    _, _, page = written
    assert DECK in page.texts["pre"]


def test_the_page_needs_nothing_else(written):
    _, _, page = written
    assert not {"script", "link", "iframe", "object", "base"} & set(page.tags)
    rest = re.sub(r"data:image/png;base64,[A-Za-z0-9+/=]*", "", page.html)
    assert not re.search(r"(https?|file):|//[a-z]|@import|url\(", rest, re.IGNORECASE)
    sources = [value for name, value in page.attributes if name in {"src", "href", "srcset"}]
    assert len(sources) == 4
    assert all(source.startswith("data:image/png;base64,") for source in sources)


def test_the_pictures_of_the_page_are_the_files_beside_it(written):
    _, directory, page = written
    embedded = [
        base64.b64decode(value.partition(",")[2])
        for name, value in page.attributes
        if name == "src"
    ]
    files = {path.name: path.read_bytes() for path in directory.figures.iterdir()}
    assert set(files) == {"volume.png", "velocity.png", "piston.png", "snapshot-0000000000.png"}
    assert sorted(embedded) == sorted(files.values())
    assert all(picture.startswith(b"\x89PNG") for picture in embedded)
    assert all(value for name, value in page.attributes if name == "alt")


def test_a_snapshot_that_cannot_be_read_is_an_error_that_names_it(tmp_path):
    directory = RunDirectory(tmp_path)
    directory.dumps.mkdir()
    directory.deck.write_text(DECK)
    (directory.dumps / "snapshot.0000000007.ppm").write_bytes(ONE_SNAPSHOT[:-100])
    with pytest.raises(ParseError, match=r"snapshot\.0000000007\.ppm: cannot be read"):
        write_report(*collision(), directory)
    assert not directory.report.exists()
