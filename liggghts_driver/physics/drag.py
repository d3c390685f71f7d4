"""Drag on a sphere (Eqs. 17-19) and the motion that follows from it.

The law is written with the *drag factor* f(Re) = Re C_D / 24, the drag over Stokes' drag: the
force is then -6 pi mu r f(Re) (v - v_f), which has no division by zero for a sphere at rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class Branch:
    """One line of Eq. 18, as f = factor x Re^power for Re up to ``up_to``."""

    up_to: float
    factor: float
    power: float


#: Eq. 18 (Biringen & Chow 2011) times Re / 24.
BRANCHES: tuple[Branch, ...] = (
    Branch(1.0, 1.0, 0.0),
    Branch(400.0, 1.0, 0.354),
    Branch(3.0e5, 0.5 / 24.0, 1.0),
    Branch(2.0e6, 0.000366 / 24.0, 1.4275),
    Branch(np.inf, 0.18 / 24.0, 1.0),
)


def drag_factor(reynolds: ArrayLike) -> NDArray[np.float64]:
    """Drag over Stokes' drag, f(Re) = Re C_D / 24 (Eq. 18); any shape, f(0) = 1."""
    re = np.asarray(reynolds, dtype=float)
    conditions = [re <= branch.up_to for branch in BRANCHES]
    return np.select(conditions, [branch.factor * re**branch.power for branch in BRANCHES])


def reynolds(
    fluid_density_kg_m3: float,
    viscosity_pa_s: float,
    radius_m: ArrayLike,
    relative_speed_m_s: ArrayLike,
) -> NDArray[np.float64]:
    """Reynolds number of a sphere, Eq. 19: 2 rho_f r |v - v_f| / mu_f."""
    diameter = 2.0 * np.asarray(radius_m, dtype=float)
    speed = np.abs(np.asarray(relative_speed_m_s, dtype=float))
    return np.asarray(fluid_density_kg_m3 * diameter * speed / viscosity_pa_s)


def drag_coefficient_n_s_m(
    fluid_density_kg_m3: float,
    viscosity_pa_s: float,
    radius_m: ArrayLike,
    relative_speed_m_s: ArrayLike,
) -> NDArray[np.float64]:
    """K in F = -K (v - v_f) [N s/m], Eqs. 17-19."""
    re = reynolds(fluid_density_kg_m3, viscosity_pa_s, radius_m, relative_speed_m_s)
    stokes = 6.0 * np.pi * viscosity_pa_s * np.asarray(radius_m, dtype=float)
    return np.asarray(stokes * drag_factor(re))


def pressure_force_n(radius_m: float, gradient_pa_m: float) -> float:
    """Force of a pressure gradient on a sphere along the flow, Eq. 20: 2 pi r^3 |grad p| [N]."""
    return float(2.0 * np.pi * radius_m**3 * gradient_pa_m)


def free_flight_speed_m_s(
    fluid_density_kg_m3: float, viscosity_pa_s: float, radius_m: float, driving_force_n: float
) -> float:
    """Speed at which drag balances a constant force on a lone sphere [m/s].

    For the pressure force of Eq. 20 this is C_D(Re) v^2 = 4 r |grad p| / rho_f.
    """
    if driving_force_n == 0.0:
        return 0.0
    re_per_speed = 2.0 * fluid_density_kg_m3 * radius_m / viscosity_pa_s
    stokes_speed = abs(driving_force_n) / (6.0 * np.pi * viscosity_pa_s * radius_m)
    target = re_per_speed * stokes_speed  # Re f(Re) at balance; each branch is inverted in turn
    for branch in BRANCHES:
        re = float((target / branch.factor) ** (1.0 / (1.0 + branch.power)))
        if re <= branch.up_to:
            return re / re_per_speed
    raise AssertionError("the last branch of Eq. 18 has no upper end")
