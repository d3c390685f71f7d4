"""The figures of a report: what each shows, and which of them a run calls for."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from liggghts_driver.report.motion import paint_motion, paint_piston
from liggghts_driver.report.picture import Picture
from liggghts_driver.report.rates import paint_velocity, paint_volumes
from liggghts_driver.report.style import draw

if TYPE_CHECKING:
    from collections.abc import Iterator

    from liggghts_driver.case import Case
    from liggghts_driver.results.answer import Answer

_HEIGHT_IN = 4.2


def draw_figures(case: Case, answer: Answer) -> tuple[Picture, ...]:
    """Every figure that a run calls for, in the order of the page."""
    return tuple(_figures(case, answer))


def _figures(case: Case, answer: Answer) -> Iterator[Picture]:
    if case.scene.specimen is None:
        yield _motion(answer)
    else:
        yield _volume(answer)
        if answer.series["flowing_velocity_m_s"].notna().any():
            yield _velocity(answer)
    if case.scene.piston is not None:
        yield _piston(answer, case.piston_mass_kg * case.scene.piston.acceleration)


def _volume(answer: Answer) -> Picture:
    return Picture(
        "volume",
        draw(partial(paint_volumes, answer), _HEIGHT_IN),
        "Volume of particles past each section against time",
        "Volume of particles that has passed each section since the start. The broad bands are "
        "the fitted slopes, each over the part of the run that it was fitted to.",
    )


def _velocity(answer: Answer) -> Picture:
    return Picture(
        "velocity",
        draw(partial(paint_velocity, answer), _HEIGHT_IN),
        "Mean velocity and number of the flowing particles against time",
        "Above: mean velocity along x of the particles that flow inside the specimen. Below: how "
        "many particles are inside, and how many of these flow.",
    )


def _piston(answer: Answer, driving_force_n: float) -> Picture:
    return Picture(
        "piston",
        draw(partial(paint_piston, answer, driving_force_n), _HEIGHT_IN),
        "Position of the piston and the resistance that it meets against time",
        "Above: place of the piston. Below, on a logarithmic scale: the resistance of the "
        "particles and grains that touch it. Where this equals the driving force, the piston "
        "keeps its speed.",
    )


def _motion(answer: Answer) -> Picture:
    return Picture(
        "motion",
        draw(partial(paint_motion, answer), _HEIGHT_IN),
        "Largest speed and kinetic energy against time",
        "Above: speed of the fastest particle. Below: kinetic energy of all particles.",
    )
