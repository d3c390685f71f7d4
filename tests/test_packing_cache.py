"""The cache of packings: a hit only for the same inputs, and never a crash."""

from __future__ import annotations

import os

import numpy as np
import pytest

from liggghts_driver.packing import cache, cached_packing

INPUTS = {"seed": 1, "size_m": [0.1, 0.1, 0.1], "cut": "bulk"}


class Counted:
    """A computation that counts its calls and gives another result each time."""

    def __init__(self):
        self.calls = 0

    def __call__(self):
        self.calls += 1
        return {
            "centres_m": np.arange(6.0).reshape(2, 3) + self.calls,
            "identity": np.array([self.calls, -1]),  # a name that the file itself uses
        }


@pytest.fixture
def compute() -> Counted:
    return Counted()


@pytest.fixture(autouse=True)
def root(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache"


def the_file(root):
    (path,) = (root / "liggghts-driver" / "packings").iterdir()
    return path


def test_second_call_reads_what_the_first_computed(compute):
    first = cached_packing("specimen", INPUTS, compute)
    # The order of the inputs' names does not matter.
    second = cached_packing("specimen", dict(reversed(INPUTS.items())), compute)
    assert compute.calls == 1
    assert first.keys() == second.keys()
    for name, array in first.items():
        assert second[name].dtype == array.dtype
        assert np.array_equal(second[name], array)


def test_the_file_is_named_by_a_hash_and_opens_as_npz(compute, root):
    cached_packing("specimen", INPUTS, compute)
    path = the_file(root)
    assert path.suffix == ".npz"
    assert len(bytes.fromhex(path.stem)) == 32
    with np.load(path) as file:
        assert str(file["identity"]) == (
            '{"inputs":{"cut":"bulk","seed":1,"size_m":[0.1,0.1,0.1]},"kind":"specimen",'
            f'"version":{cache.ALGORITHM_VERSION}}}'
        )


@pytest.mark.parametrize(
    ("kind", "inputs"),
    [
        ("specimen", INPUTS | {"seed": 2}),
        ("specimen", INPUTS | {"size_m": [0.1, 0.1, 0.1 + 1e-16]}),
        ("specimen", {}),
        ("particles", INPUTS),
    ],
)
def test_other_inputs_are_computed(compute, kind, inputs):
    cached_packing("specimen", INPUTS, compute)
    cached_packing(kind, inputs, compute)
    assert compute.calls == 2


def test_another_version_of_the_algorithm_computes_anew(compute, monkeypatch):
    cached_packing("specimen", INPUTS, compute)
    monkeypatch.setattr(cache, "ALGORITHM_VERSION", cache.ALGORITHM_VERSION + 1)
    cached_packing("specimen", INPUTS, compute)
    assert compute.calls == 2


def test_a_file_truncated_or_altered_anywhere_is_computed_and_replaced(compute, root):
    cached_packing("specimen", INPUTS, compute)
    path = the_file(root)
    sound = path.read_bytes()
    # Every eleventh byte reaches every part of the archive's headers, data and directory.
    damaged = [sound[:size] for size in range(0, len(sound), 11)]
    for place in range(0, len(sound), 11):
        altered = bytearray(sound)
        altered[place] ^= 0x81
        damaged.append(bytes(altered))
    for content in damaged:
        path.write_bytes(content)
        expected = compute.calls + 1
        made = cached_packing("specimen", INPUTS, compute)
        assert compute.calls == expected
        assert made["identity"][0] == expected
        # The replacement is sound: it is read, not computed.
        assert cached_packing("specimen", INPUTS, compute)["identity"][0] == expected
    assert len(list(path.parent.iterdir())) == 1


def test_a_file_made_from_other_inputs_is_not_believed(compute, root):
    cached_packing("specimen", INPUTS, compute)
    mine = the_file(root)
    name = mine.name
    other = mine.rename(mine.with_name("other.npz"))
    cached_packing("specimen", INPUTS | {"seed": 2}, compute)
    (theirs,) = (path for path in other.parent.iterdir() if path != other)
    theirs.rename(theirs.with_name(name))
    cached_packing("specimen", INPUTS, compute)
    assert compute.calls == 3


def test_a_folder_that_cannot_be_made_only_means_no_cache(compute, root):
    root.write_text("a file where the folder should be")
    for calls in (1, 2):
        assert cached_packing("specimen", INPUTS, compute)["identity"][0] == calls


def test_a_failed_write_leaves_nothing_behind(compute, root, monkeypatch):
    def full_disk(*_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(cache.Path, "replace", full_disk)
        assert cached_packing("specimen", INPUTS, compute)["identity"][0] == 1
    assert list((root / "liggghts-driver" / "packings").iterdir()) == []


def test_default_folder_is_in_the_home(compute, tmp_path, monkeypatch):
    # The XDG rules: a relative path counts as not set.
    for setting in (None, "", "relative/path"):
        if setting is None:
            monkeypatch.delenv("XDG_CACHE_HOME")
        else:
            monkeypatch.setenv("XDG_CACHE_HOME", setting)
        monkeypatch.setenv("HOME", str(tmp_path / "home"))
        cached_packing("specimen", INPUTS, compute)
    assert compute.calls == 1
    the_file(tmp_path / "home" / ".cache")


def test_no_home_only_means_no_cache(compute, monkeypatch):
    def homeless():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setattr(cache.Path, "home", homeless)
    assert cached_packing("specimen", INPUTS, compute)["identity"][0] == 1
    assert cached_packing("specimen", INPUTS, compute)["identity"][0] == 2


@pytest.mark.parametrize("value", [float("nan"), {1, 2}, np.arange(3)])
def test_inputs_that_are_not_json_are_refused(compute, value):
    with pytest.raises((TypeError, ValueError)):
        cached_packing("specimen", {"value": value}, compute)
    assert compute.calls == 0


def test_a_failing_computation_is_not_hidden(root):
    def failing():
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        cached_packing("specimen", INPUTS, failing)
    assert not os.path.lexists(root)
