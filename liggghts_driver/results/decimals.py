"""Numbers in text, eight characters to a machine word.

A particle dump is a table of short decimal numbers, and turning digits into doubles is nearly all
the work of reading one. Here a number's last eight characters are fetched as one 64-bit word, and
NumPy then works on the words of thousands of numbers at once: find the decimal point, close the
gap it leaves, check that all the rest are digits, and add the digits up pairwise.

The result is exact, the same double as ``float`` gives: at most eight digits make an integer that
a double holds without error, and so are the powers of ten up to 10^22, so the one division (or
multiplication) by a power of ten is the only rounding. Numbers that do not fit this pattern (more
digits, larger exponents, ``nan``, ``inf``) are converted one at a time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Bytes = NDArray[np.uint8]
    Words = NDArray[np.uint64]
    Indices = NDArray[np.intp]
    Floats = NDArray[np.float64]
    Flags = NDArray[np.bool_]

_WORD = 8
_SHOWN = 60  # characters of a faulty line that a message shows


def _repeated(byte: int) -> np.uint64:
    return np.uint64(int.from_bytes(bytes([byte]) * _WORD, "little"))


_ZEROS = _repeated(ord("0"))
_POINTS = _repeated(ord(".") ^ ord("0"))
_ONES = _repeated(0x01)
_TOP_BITS = _repeated(0x80)
_CARRY_ABOVE_9 = _repeated(0x80 - 10)
_BYTE = np.uint64(8)
_WORD_BITS = np.uint64(64)

# Multiplying a word with only bit 8j set by this brings 8 - j into the top byte.
_DISTANCE_FROM_END = np.uint64(0x0807060504030201)

# Eight digits as pairs of bytes, then of 16 bits, then of 32 bits: multiply, shift, mask.
_PAIRINGS = (
    (np.uint64(10 * 2**8 + 1), np.uint64(8), np.uint64(0x00FF00FF00FF00FF)),
    (np.uint64(100 * 2**16 + 1), np.uint64(16), np.uint64(0x0000FFFF0000FFFF)),
    (np.uint64(10000 * 2**32 + 1), np.uint64(32), np.uint64(0x00000000FFFFFFFF)),
)

_MAX_POWER = 22
_POWERS = np.array([float(10**k) for k in range(_MAX_POWER + 1)])
_NEGATIVE = 32
_SIGNED_POWERS = np.concatenate([_POWERS, np.ones(_NEGATIVE - _POWERS.size), -_POWERS])


class RowError(ValueError):
    """A row of a text table is not what it should be.

    Attributes
    ----------
    row : int
        Which row, counted from 0.
    """

    def __init__(self, row: int, message: str) -> None:
        super().__init__(message)
        self.row = row


def parse_rows(text: bytes, columns: int) -> Floats:
    """Parse whole lines of `columns` numbers, each number followed by one space.

    Parameters
    ----------
    text : bytes
        At least one line as the engine writes them, each ending in a space and a newline.
    columns : int
        Numbers per line.

    Returns
    -------
    ndarray, shape (rows, columns)
        Every number exactly as ``float`` would read it.

    Raises
    ------
    RowError
        If a line has another number of fields, or a field is not a number.
    """
    # A word is fetched as parts of two neighbours, one of which may lie outside the text.
    padding = bytes(_WORD)
    padded = np.frombuffer(padding + text + padding + bytes(-len(text) % _WORD), dtype=np.uint8)
    start, end = _fields(text, columns)
    values, odd = _convert(padded, start, end)
    for k, first, last in zip(odd.tolist(), start[odd].tolist(), end[odd].tolist(), strict=True):
        values[k] = _convert_one(text[first:last], k // columns)
    return values.reshape(-1, columns)


def _fields(text: bytes, columns: int) -> tuple[Indices, Indices]:
    """Where each number starts and ends (exclusive)."""
    characters = np.frombuffer(text, dtype=np.uint8)
    end = np.flatnonzero(characters == ord(" "))
    if not end.size or end.size % columns or end[-1] + 2 != len(text):
        raise _wrong_row(text, columns)
    if (characters[end[columns - 1 :: columns] + 1] != ord("\n")).any():
        raise _wrong_row(text, columns)
    start = np.empty_like(end)
    start[0] = 0
    np.add(end[:-1], 1, out=start[1:])
    start[columns::columns] += 1
    return start, end


def _wrong_row(text: bytes, columns: int) -> RowError:
    lines = text.splitlines(keepends=True)
    wrong = (line.count(b" ") != columns or not line.endswith(b" \n") for line in lines)
    row = next(k for k, is_wrong in enumerate(wrong) if is_wrong)
    found = lines[row][:_SHOWN]
    return RowError(row, f"expected {columns} numbers, each followed by one space, found {found!r}")


def _convert_one(field: bytes, row: int) -> float:
    try:
        value = float(field)
    except ValueError:
        raise RowError(row, f"expected a number, found {field[:_SHOWN]!r}") from None
    if b"_" in field or field != field.strip():  # float() takes these, the engine writes none
        raise RowError(row, f"expected a number, found {field[:_SHOWN]!r}")
    return value


def _convert(padded: Bytes, start: Indices, end: Indices) -> tuple[Floats, Indices]:
    """Values of all fields, and the indices of those that must be converted one at a time."""
    text = padded[_WORD:]
    negative = text.take(start) == ord("-")
    scientific, exponent, odd = _exponents(padded, end)
    end = end.copy()
    end[scientific] -= 4  # what is left is sign and mantissa

    start = start + negative
    zeros = _leading_zeros(text).take(start)
    fraction = zeros > 0
    digits = np.minimum(end - start, 255).astype(np.uint8) - zeros - fraction
    word = _fetch(padded, end, digits)
    decimals, bad = _close_gap(word)
    pointed = decimals > 0
    odd |= bad | (digits > _WORD) | (fraction & pointed) | (~fraction & (digits <= pointed))
    decimals += (np.uint8(_WORD) - digits) * ~pointed
    decimals += (zeros + digits - np.uint8(1)) * fraction

    mantissa = _sum_digits(word).astype(np.float64)
    values = mantissa / _SIGNED_POWERS.take(decimals + negative * np.uint8(_NEGATIVE), mode="clip")
    if scientific.size:
        power = exponent - decimals[scientific]
        odd[scientific] |= np.abs(power) > _MAX_POWER
        scaled = mantissa[scientific] * _POWERS.take(power, mode="clip")
        scaled /= _POWERS.take(-power, mode="clip")
        values[scientific] = np.where(negative[scientific], -scaled, scaled)
    return values, np.flatnonzero(odd)


def _exponents(padded: Bytes, end: Indices) -> tuple[Indices, NDArray[np.int64], Flags]:
    """Which numbers end in ``e+dd`` or ``e-dd``, their exponents; which of all are malformed."""
    scientific = np.flatnonzero(padded.take(end + (_WORD - 4)) == ord("e"))
    sign, tens, ones = (padded[end[scientific] + (_WORD - k)] for k in (3, 2, 1))
    tens -= np.uint8(ord("0"))
    ones -= np.uint8(ord("0"))
    malformed = np.zeros(end.size, dtype=np.bool_)
    malformed[scientific] = (tens > 9) | (ones > 9) | ((sign != ord("+")) & (sign != ord("-")))
    exponent = tens.astype(np.int64) * 10 + ones
    return scientific, np.where(sign == ord("-"), -exponent, exponent), malformed


def _leading_zeros(text: Bytes) -> Bytes:
    """At each place, the number of zeros in the "0." or "0.0" that stands there, if any.

    Such a beginning is skipped, so that the digits of 0.00138946 and 0.000123456 fit in a word.
    """
    zero = (text == ord("0")).view(np.uint8)
    point = (text == ord(".")).view(np.uint8)
    zeros = np.zeros_like(text)
    whole = zero[:-2] & point[1:-1]
    np.add(whole, whole & zero[2:], out=zeros[:-2])
    return zeros


def _fetch(padded: Bytes, end: Indices, count: Bytes) -> Words:
    """The last `count` (at most 8) characters before `end`, from byte 0 on, XORed with "0"."""
    words = padded.view("<u8")
    index = end >> 3
    bits = end & 7
    bits <<= 3
    shift = bits.view(np.uint64)
    before = words[:-1].take(index)
    before >>= shift
    word: Words = words[1:].take(index)
    np.subtract(_WORD_BITS, shift, out=shift)
    word <<= shift
    word |= before
    word ^= _ZEROS
    word >>= (np.uint8(_WORD * 8) - count * np.uint8(8)).astype(np.uint64)
    return word


def _close_gap(word: Words) -> tuple[Bytes, Flags]:
    """Take the decimal point out of each word, in place, and move up what follows it.

    Returns
    -------
    decimals, bad
        How many of a word's eight digits now stand behind the point's place (0 where there is no
        point), and which words hold anything but digits.
    """
    # The point's byte becomes zero, and only there does subtracting one borrow from the top bit.
    probe = word ^ _POINTS
    point = probe - _ONES
    np.invert(probe, out=probe)
    point &= probe
    point &= _TOP_BITS
    point >>= np.uint64(7)
    np.multiply(point, _DISTANCE_FROM_END, out=probe)
    probe >>= _WORD_BITS - _BYTE
    decimals = probe.astype(np.uint8)
    point -= np.uint64(1)  # from here on a mask of what stands before the point
    np.right_shift(word, _BYTE, out=probe)
    word ^= probe
    word &= point
    word ^= probe
    np.add(word, _CARRY_ABOVE_9, out=probe)
    probe |= word
    probe &= _TOP_BITS
    return decimals, probe != 0


def _sum_digits(word: Words) -> Words:
    """Turn each word, in place, into the integer whose digits are its bytes, the highest first."""
    for factor, shift, mask in _PAIRINGS:
        word *= factor
        word >>= shift
        word &= mask
    return word
