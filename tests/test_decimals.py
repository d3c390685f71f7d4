"""Numbers parsed from text are the doubles that ``float`` reads, whatever the text."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from liggghts_driver.results import decimals
from liggghts_driver.results.decimals import RowError, parse_rows

FORMATS = ("%g", "%.3f", "%.8f", "%d", "%.8g", "%.10g", "%.17g", "%e", "%.0e")
MAGNITUDES = st.floats(min_value=-1e12, max_value=1e12) | st.floats(min_value=-1e-3, max_value=1e-3)
NUMBERS = st.builds(lambda form, value: form % value, st.sampled_from(FORMATS), MAGNITUDES)
SPECIAL = st.sampled_from(
    [
        *("nan", "-nan", "inf", "-inf", "0", "-0", "0.", "0.0", "-0.0", ".5", "5.", "00.5", "+5"),
        *("007", "12345678", "123456789", "-12345678.9", "0.000123456", "-0.123456789", "1e5"),
        *("0e+00", "1e+22", "1e-22", "1e+23", "1e-300", "9.99999e-17", "-1.23456e-10", "0.5e-05"),
    ]
)
# All that stands in a number, what is near it in the character table, and white space.
NOISE = st.text(alphabet="0123456789.-+e0.0.einfaE_/:,!\t\r\n\0Iαx", max_size=18)


def whole_lines(fields: list[str], columns: int) -> bytes:
    rows = [fields[k : k + columns] for k in range(0, len(fields), columns)]
    return "".join("".join(f"{field} " for field in row) + "\n" for row in rows).encode()


def by_float(field: str) -> float | None:
    """Value of a field, or None where the engine cannot have written it."""
    if "_" in field or field != field.strip():
        return None
    try:
        return float(field.encode())
    except ValueError:
        return None


@given(st.lists(NUMBERS | SPECIAL, min_size=1, max_size=40))
def test_every_number_is_the_double_that_float_reads(fields):
    parsed = parse_rows(whole_lines(fields, 1), 1)
    expected = np.array([[float(field)] for field in fields])
    # Bit by bit (exact), so that the sign of zero counts too; all NaN are taken as one.
    np.testing.assert_array_equal(parsed, expected)
    np.testing.assert_array_equal(
        np.signbit(parsed[~np.isnan(parsed)]), np.signbit(expected[~np.isnan(expected)])
    )


@given(NOISE, NUMBERS, NUMBERS)
@example("1e", "1", "1")
@example("e-05", "1", "1")
@example("-e-05", "1", "1")
@example("1e-/5", "1", "1")
@example("1e-:5", "1", "1")
@example("1e-0/", "1", "1")
@example("1e-0:", "1", "1")
@example("1e005", "1", "1")
@example("0.1.2", "1", "1")
@example("..", "1", "1")
@example("1/2", "1", "1")
@example("5" * 258, "1", "1")
def test_a_field_is_read_as_float_reads_it_or_refused(field, before, after):
    text = whole_lines([before, field, after], 3)
    expected = by_float(field)
    if expected is None:
        with pytest.raises(RowError):
            parse_rows(text, 3)
    else:
        values = [float(before), expected, float(after)]
        np.testing.assert_array_equal(parse_rows(text, 3), [values])


def test_numbers_as_the_engine_prints_them_need_no_second_look(monkeypatch):
    # Six digits, exponents down to -15: seven decimals more make 10^22, the last exact power.
    rng = np.random.default_rng(2)
    values = rng.normal(size=3000) * 10.0 ** rng.integers(-14, 9, 3000)
    fields = [f"{value:g}" for value in values[np.abs(values) > 1e-15]]
    monkeypatch.delattr(decimals, "_convert_one")
    parsed = parse_rows(whole_lines(fields, 1), 1)
    assert parsed[:, 0].tolist() == [float(field) for field in fields]


def test_large_tables_keep_their_shape():
    # Long enough for every phase of a number's end against the 8-byte words.
    rng = np.random.default_rng(1)
    fields = [f"{value:g}" for value in rng.normal(size=7 * 3000) * 10.0 ** rng.integers(-9, 6)]
    expected = np.array([float(field) for field in fields]).reshape(3000, 7)
    np.testing.assert_array_equal(parse_rows(whole_lines(fields, 7), 7), expected)


@pytest.mark.parametrize(
    ("text", "row"),
    [
        (b"1 2 \n3 \n", 1),
        (b"1 2 \n3 4 5 \n", 1),
        (b"1 \n2 3 4 \n", 0),
        (b"1 2 \n3 4\n", 1),
        (b"1 2 \n3 4 ", 1),
        (b"1 2 \n3 4", 1),
        (b"1 2 \n\n3 4 \n", 1),
        (b"1 2 \n3  4 \n", 1),
        (b"1 2 \n3 \n4 \n", 1),
        (b"1 2 \n3 4 \r\n", 1),
        (b"1 2 \n3\t4 \n", 1),
        (b"1 2 \n3 x \n", 1),
        (b"\n", 0),
    ],
)
def test_a_fault_names_its_row(text, row):
    with pytest.raises(RowError) as caught:
        parse_rows(text, 2)
    assert caught.value.row == row
