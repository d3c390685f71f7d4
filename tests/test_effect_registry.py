"""Effects are found by themselves, one file each; what cannot be is refused at once."""

from __future__ import annotations

import sys
import textwrap

import pytest

from liggghts_driver.effects import EFFECTS
from liggghts_driver.effects.registry import find_effects
from liggghts_driver.effects.settings import conflicts
from liggghts_driver.resources import templates_dir

TEMPLATE = """
from liggghts_driver.effects.base import Effect, Weight

class {name}(Effect):
    name = "{label}"
    title = "{label}"
    slot = "{slot}"
    order = {order}
    conflicts = {conflicts}

    def decide(self, scene):
        return True, "always"

    def weigh(self, case):
        return Weight("one", "one over one", 1.0)
"""


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A package of effects, made file by file."""
    folder = tmp_path / "own_effects"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    monkeypatch.syspath_prepend(str(tmp_path))

    def add(label, slot="forces", order=0, conflicts=()):
        fields = {"label": label, "slot": slot, "order": order, "conflicts": conflicts}
        text = TEMPLATE.format(name=label.title(), **fields)
        (folder / f"{label}_file.py").write_text(textwrap.dedent(text))

    yield add, lambda: find_effects("own_effects", [str(folder)])
    for module in [name for name in sys.modules if name.startswith("own_effects")]:
        del sys.modules[module]


def test_found_in_the_order_of_the_deck(package):
    add, find = package
    add("wind")
    add("heat", slot="materials")
    add("rain", order=-1)
    assert [effect.name for effect in find()] == ["heat", "rain", "wind"]


def test_an_unknown_partner_is_refused(package):
    add, find = package
    add("wind", conflicts=("calm",))
    with pytest.raises(ValueError, match="wind names unknown calm"):
        find()


def test_two_of_one_name_are_refused(package, tmp_path):
    add, find = package
    add("wind")
    (tmp_path / "own_effects/again.py").write_text(
        TEMPLATE.format(name="Again", label="wind", slot="forces", order=0, conflicts=())
    )
    with pytest.raises(ValueError, match="more than one effect is called wind"):
        find()


def test_two_that_exclude_each_other_are_a_mistake(package):
    add, find = package
    add("wind", conflicts=("calm",))
    add("calm")
    (mistake,) = conflicts(None, find())
    assert "wind" in str(mistake)
    assert "cannot be in one deck with calm" in str(mistake)


def test_each_effect_has_a_file_and_a_fragment_of_its_own():
    modules = [type(effect).__module__ for effect in EFFECTS]
    assert len(set(modules)) == len(EFFECTS)
    fragments = {path.stem for path in (templates_dir() / "effects").iterdir()}
    assert {effect.name for effect in EFFECTS} - {"drag"} <= fragments
