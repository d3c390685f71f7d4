"""Which particles count as flowing: the paper averages the velocity of those only."""

from __future__ import annotations

from typing import TYPE_CHECKING

from liggghts_driver.physics.drag import free_flight_speed_m_s, pressure_force_n
from liggghts_driver.physics.oscillation import angular_rate_rad_s
from liggghts_driver.physics.spheres import sphere_volume_m3

if TYPE_CHECKING:
    from liggghts_driver.scene.model import Scene

#: A particle slower than this share of the free-flight speed is held, not flowing.
SHARE_OF_FREE_FLIGHT = 0.1


def flowing_threshold_m_s(scene: Scene) -> float:
    """The x velocity above which a particle inside the specimen flows.

    ``output.flowing_above`` or, without it, a tenth of the speed at which a lone particle of
    mean radius settles under the scene's pressure gradient (Eqs. 17-20). If the gradient goes to
    and fro, of the speed that it reaches in between: no more than without drag, force / (mass w).
    """
    if scene.output.flowing_above is not None:
        return scene.output.flowing_above
    fluid, pressure, radius = scene.fluid, scene.pressure, scene.particles.radius_mean
    if fluid is None or pressure is None or radius is None:
        return 0.0
    force = pressure_force_n(radius, pressure.gradient)
    free = free_flight_speed_m_s(fluid.density, fluid.viscosity, radius, force)
    if pressure.period is not None:
        mass = scene.particles.density * sphere_volume_m3(radius)
        free = min(free, abs(force) / (mass * angular_rate_rad_s(pressure.period)))
    return SHARE_OF_FREE_FLIGHT * free
