"""Which particles count as flowing: the paper averages the velocity of those only."""

from __future__ import annotations

from typing import TYPE_CHECKING

from liggghts_driver.physics.drag import free_flight_speed_m_s, pressure_force_n

if TYPE_CHECKING:
    from liggghts_driver.scene.model import Scene

#: A particle slower than this share of the free-flight speed is held, not flowing.
SHARE_OF_FREE_FLIGHT = 0.1


def flowing_threshold_m_s(scene: Scene) -> float:
    """The x velocity above which a particle inside the specimen flows.

    ``output.flowing_above`` or, without it, a tenth of the speed at which a lone particle of
    mean radius settles under the scene's pressure gradient (Eqs. 17-20).
    """
    if scene.output.flowing_above is not None:
        return scene.output.flowing_above
    fluid, pressure, radius = scene.fluid, scene.pressure, scene.particles.radius_mean
    if fluid is None or pressure is None or radius is None:
        return 0.0
    force = pressure_force_n(radius, pressure.gradient)
    free = free_flight_speed_m_s(fluid.density, fluid.viscosity, radius, force)
    return SHARE_OF_FREE_FLIGHT * free
