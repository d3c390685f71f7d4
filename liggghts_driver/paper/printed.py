"""What the paper prints of its example: Table 1, its text of Section 6, and its own slips.

Everything in SI. Table 1 heads its first column with m3/s and gives kPa/m. Its first row has
1.95e-6 and 1.93e-6 m3/s for the simulation, ten times what stands beside them and what the graph of
Fig. 5 must show: a slip of the exponent, read as e-7 here.
"""

from __future__ import annotations

from dataclasses import dataclass

#: Where the volume that passes is measured: the entrance of the cube, and its middle.
SECTIONS = ("entrance", "middle")


@dataclass(frozen=True)
class Row:
    """A row of Table 1: flow rates of particles [m3/s], velocities [m/s]."""

    gradient_pa_m: float
    law_m3_s: float
    entrance_m3_s: float
    middle_m3_s: float
    law_m_s: float
    velocity_m_s: tuple[float, float]

    def flow_m3_s(self, section: str) -> float:
        """The simulated flow rate past a section."""
        return {"entrance": self.entrance_m3_s, "middle": self.middle_m3_s}[section]


#: Table 1, its first row with the exponents read as -7.
TABLE_1 = (
    Row(1.0, 1.92e-7, 1.95e-7, 1.93e-7, 2.84e-4, (2.69e-4, 2.94e-4)),
    Row(2.0, 3.84e-7, 4.09e-7, 3.72e-7, 5.68e-4, (5.12e-4, 5.87e-4)),
    Row(5.0, 9.62e-7, 9.68e-7, 9.71e-7, 1.42e-3, (1.01e-3, 1.76e-3)),
    Row(10.0, 1.92e-6, 1.97e-6, 1.86e-6, 2.84e-3, (2.71e-3, 2.96e-3)),
    Row(20.0, 3.84e-6, 2.24e-6, 2.65e-6, 5.68e-3, (4.13e-3, 4.96e-3)),
)
ROWS = {row.gradient_pa_m: row for row in TABLE_1}
#: The gradient of Figs. 3, 4 and 6.
MAIN_GRADIENT_PA_M = 10.0
#: As the first row of Table 1 has it [m3/s]: entrance and middle.
FIRST_ROW_AS_PRINTED_M3_S = (1.95e-6, 1.93e-6)
#: "At around t = 10 s, the steady-state phase is reached", at both sections.
STEADY_FROM_S = 10.0
#: The effective permeability of Section 6 [m2].
PERMEABILITY_M2 = 1.84e-7
#: "~ 0.06 h/1.0 s of the problem's duration in a standard, single-processor laptop".
COST_S_PER_S = 0.06 * 3600.0
#: The step of Section 6 [s].
STEP_S = 1e-4
#: "The maximum value possible for Darcy-like (slow) viscous flows, which is around Re = 10".
LARGEST_REYNOLDS = 10.0
#: Numbers of particles and of grains.
PARTICLES, GRAINS = 21_500, 215
