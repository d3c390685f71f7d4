"""Rendering is strict: nothing undefined, nothing that is no plain text, nothing rounded."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from liggghts_driver.deck import render as module
from liggghts_driver.deck.render import render
from liggghts_driver.errors import DeckError


@pytest.fixture(scope="module", autouse=True)
def templates(tmp_path_factory):
    """A folder of small templates in the place of the real ones."""
    folder = tmp_path_factory.mktemp("templates")
    (folder / "value.j2").write_text("{{ value }}")
    (folder / "inner.j2").write_text("# heading\n\n{{ outer.value }}\n")
    (folder / "outer.j2").write_text('{% include "inner.j2" %}')
    (folder / "broken.j2").write_text("# heading\n{% if %}\n")
    (folder / "choice.j2").write_text("{% if value %}\n  yes\n{% else %}\nno\n{% endif %}\nend\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "templates_dir", lambda: folder)
        yield folder


@given(st.floats(allow_nan=False, allow_infinity=False))
@settings(deadline=None)
def test_numbers_keep_every_digit(value):
    assert float(render("value.j2", {"value": value})) == value


@pytest.mark.parametrize(
    ("value", "text"),
    [(1, "1"), (10**20, "1" + "0" * 20), (0.1, "0.1"), ("a b", "a b"), ("", "")],
)
def test_plain_values(value, text):
    assert render("value.j2", {"value": value}) == text


def test_numbers_of_numpy_print_like_others():
    assert render("value.j2", {"value": np.float64(0.1)}) == "0.1"


@pytest.mark.parametrize(
    "value",
    [
        None,
        math.nan,
        math.inf,
        -math.inf,
        np.float64("nan"),
        True,
        False,
        [1.0],
        (1.0,),
        {"a": 1},
        {1},
        np.array([1.0]),
        np.float32(0.5),
        np.int64(1),
        1j,
        object(),
        len,
        b"text",
    ],
    ids=lambda value: type(value).__name__,
)
def test_what_is_no_plain_text_is_refused(value):
    with pytest.raises(DeckError, match="cannot stand in a deck"):
        render("value.j2", {"value": value})


def test_what_is_undefined_is_refused_by_name():
    with pytest.raises(DeckError, match=r"value\.j2.*'value' is undefined"):
        render("value.j2", {})
    with pytest.raises(DeckError, match="no attribute 'value'"):
        render("outer.j2", {"outer": {}})


def test_a_condition_on_what_is_undefined_is_refused():
    with pytest.raises(DeckError, match="undefined"):
        render("choice.j2", {})


def test_a_broken_template_is_told_with_its_line():
    with pytest.raises(DeckError, match=r"broken\.j2, line 2"):
        render("broken.j2", {})


def test_a_missing_template_is_told():
    with pytest.raises(DeckError, match=r"absent\.j2"):
        render("absent.j2", {})


def test_blocks_leave_no_empty_lines():
    assert render("choice.j2", {"value": 1}) == "  yes\nend\n"
    assert render("choice.j2", {"value": 0}) == "no\nend\n"
