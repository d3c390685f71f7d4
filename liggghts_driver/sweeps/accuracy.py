"""The accuracy that the scene of a sweep asks for: settled once, for all of its points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from liggghts_driver.accuracy import makes_a_problem
from liggghts_driver.scene.checks import Mistake
from liggghts_driver.scene.read import make_scene

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping


def with_settings(tables: Mapping[str, Any], arguments: str) -> dict[str, Any]:
    """Tables with the settings that their accuracy comes to written out.

    A plan keeps them, so that its points are the same runs whatever is studied in the meantime.

    Parameters
    ----------
    tables
        Of the scene that varies, settings and overrides applied.
    arguments
        What the command line calls it.

    Raises
    ------
    SceneError
        If no study tells the settings, or the tables are no scene without the axes.
    """
    scene = make_scene(tables, arguments=arguments)
    return scene.model_dump(mode="json", exclude_unset=True, exclude_none=True)


def other_problems(accuracy: Any, names: Iterable[str]) -> Iterator[Mistake]:
    """The keys that vary and make other problems than the one whose errors are known.

    Parameters
    ----------
    accuracy
        What the scene asks for; the reference needs no errors.
    names
        The keys that vary.
    """
    if accuracy == "reference" or (isinstance(accuracy, dict) and "study" not in accuracy):
        return
    for name in names:
        if makes_a_problem(name) and not name.startswith("resources."):
            bound = "the errors of its settings are known for one problem, and this varies it"
            fix = (
                "remove that axis, or give settings instead of the accuracy (`explain` lists them)"
            )
            yield Mistake("accuracy", name, bound, fix)
