"""What to do about a run that was stopped."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from liggghts_driver.case import Case
    from liggghts_driver.watch.finding import Rule


def advice(rule: Rule, case: Case, deepest_over_radius: float) -> str:
    """What to do, by the rule that was broken and by how deep the contacts were then."""
    if rule == "reynolds":
        return (
            "the scene drives its particles faster than its speed bound "
            f"({case.speed_bound_m_s:.3g} m/s) expects: {_shorter_step(case)}; if it goes as fast "
            "again, weaken what drives it"
        )
    if rule == "overlap" or deepest_over_radius > case.scene.contact.largest_overlap:
        return (
            f"contacts are too soft for what presses them together: {_stiffer(case)}, or weaken "
            "what drives the particles"
        )
    if rule == "lost":
        openings = [face for face in _FACES if face not in case.layout.walls]
        opening = f"; or close an open face ({', '.join(openings)})" if openings else ""
        return f"{_shorter_step(case)}{opening}"
    return _shorter_step(case)


_FACES = ("x-", "x+", "y-", "y+", "z-", "z+")


def _shorter_step(case: Case) -> str:
    if case.scene.time.step is not None:
        return f"use a shorter time.step than {case.scene.time.step:g} s, or leave it out"
    return f"use a smaller time.step_fraction than {case.scene.time.step_fraction:g}"


def _stiffer(case: Case) -> str:
    scale = case.scene.contact.stiffness_scale
    if scale < 1.0:
        return f"raise contact.stiffness_scale above {scale:g}"
    return "raise the bodies' youngs_modulus"
