"""How exactly a scene is simulated: what its file asks for, and by which settings it is met."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, get_args

from pydantic import AfterValidator, Field, WithJsonSchema, model_validator

from liggghts_driver.scene.fields import FrozenDict, Line, Switch, Table, Whole, key

if TYPE_CHECKING:
    from collections.abc import Mapping

Level = Literal["draft", "standard", "reference"]
#: Relative errors that a level tolerates; the reference has the finest settings there are.
TOLERATED: Mapping[str, float] = {"draft": 0.10, "standard": 0.05}

#: Every key of a scene that may differ between two computations of one problem.
NUMERICAL = (
    "time.step", "time.step_fraction", "drag.scheme", "drag.refresh", "drag.tolerance",
    "drag.carrier", "contact.stiffness_scale", "contact.largest_overlap",
)  # fmt: skip


def _numerical(settings: dict[str, Any]) -> dict[str, Any]:
    other = sorted(set(settings) - set(NUMERICAL))
    if other:
        raise ValueError(f"{', '.join(other)} is no setting; valid: {', '.join(NUMERICAL)}")
    return FrozenDict(settings)


Settings = Annotated[dict[str, float | str], AfterValidator(_numerical)]
#: A measured number, however small.
Measured = Annotated[float, Field(allow_inf_nan=False)]


class Studied(Table):
    """What a study measured of the settings that were taken from it, errors relative."""

    file: Line = key("", "file of the study")
    title: Line = key("", "title of the scene that was studied")
    command: tuple[Line, ...] = key("", "command line of the study")
    problem_sha256: Line = key("", "identity of the problem that was studied")
    duration_s: Measured = key("s", "simulated time of its runs")
    replicates: Whole = key("", "packings by which the errors are known")
    setting: Line = key("", "name of the settings in the study")
    finest: Switch = key("", "whether they are the finest, none cheaper being within the tolerance")
    error: Measured = key("", "largest mean error of the quantities that settings are chosen by")
    reach: Measured = key("", "how far the 95 % intervals of these errors reach")
    overlap: Measured = key("", "largest overlap of a contact, over the smaller radius")
    cost_over_reference: Measured = key("", "time over that of the finest settings")


class Accuracy(Table):
    """What is asked for, a level or a tolerated error; once it is settled, the settings and why.

    A file gives the level or the number alone. What is settled is written out in the scene's own
    tables, and stays here as the record of where it came from.
    """

    level: Level | None = key("", "level of accuracy", None)
    tolerance: Measured | None = key("", "relative error that is tolerated", None)
    settings: Settings | None = key("", "settings that meet it", None)
    study: Studied | None = key("", "what is known of them; nothing of the reference", None)

    @model_validator(mode="before")
    @classmethod
    def _as_table(cls, value: Any) -> Any:
        if isinstance(value, str) and value in get_args(Level):
            return {"level": value}
        if isinstance(value, float) and 0.0 < value < 1.0:
            return {"tolerance": value}
        if isinstance(value, Accuracy) or (isinstance(value, dict) and "settings" in value):
            return value
        words = ", ".join(get_args(Level))
        raise ValueError(f"must be {words}, or a relative error above 0 and below 1")

    @model_validator(mode="after")
    def _one_wish(self) -> Self:
        if (self.level is None) == (self.tolerance is None):
            raise ValueError("must have a level or a tolerance")
        return self

    @property
    def asked(self) -> str:
        """In words."""
        return self.level or f"{self.tolerance:g}"

    @property
    def tolerated(self) -> float | None:
        """The relative error that is tolerated; None for the reference."""
        return TOLERATED.get(self.level) if self.level else self.tolerance

    @property
    def is_settled(self) -> bool:
        """Whether the scene's tables hold the settings that meet it."""
        return self.settings is not None


MEANING = (
    "accuracy: draft (errors within 10 %), standard (5 %), reference (the finest settings), or the "
    "tolerated error, as 0.02; settings that are not given come from a study of the scene's "
    "accuracy (docs/accuracy.md)"
)
#: The key of a scene: people give the word or the number, only a run's own file has the table.
AccuracyKey = Annotated[
    Accuracy | None,
    WithJsonSchema(
        {
            "anyOf": [
                {"enum": list(get_args(Level)), "type": "string"},
                {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1},
                {"type": "null"},
            ]
        }
    ),
]
