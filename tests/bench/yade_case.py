# ruff: noqa: F405 - the names come from Yade's star import
"""The same spheres in Yade: Hertz-Mindlin contacts, walls, and Stokes drag in its own C++.

Run by Yade: ``yade -n -x yade_case.py particles.data STEPS STEP_S DRAG``; prints the seconds that
the steps took.
"""

import sys
import time
from pathlib import Path

from yade import *  # noqa: F403 - Yade's own idiom: its classes are made when it starts
from yade.utils import sphere, wall


def spheres(path: str) -> list[tuple[int, float, float, tuple[float, float, float]]]:
    """Type, diameter, density and centre of every sphere of an engine's data file."""
    lines = Path(path).read_text(encoding="utf-8").split("\nAtoms\n")[1].split("\nVelocities\n")[0]
    rows = [line.split() for line in lines.splitlines() if line.strip()]
    return [
        (int(r[1]), float(r[2]), float(r[3]), (float(r[4]), float(r[5]), float(r[6]))) for r in rows
    ]


data, steps, step, drag = sys.argv[1], int(sys.argv[2]), float(sys.argv[3]), sys.argv[4] == "drag"
materials = {
    1: O.materials.append(FrictMat(young=1e7, poisson=0.25, density=7000, frictionAngle=0)),
    2: O.materials.append(FrictMat(young=1e6, poisson=0.25, density=5000, frictionAngle=0)),
}
moving = []
for kind, diameter, _, centre in spheres(data):
    body = sphere(Vector3(*centre), diameter / 2, fixed=kind == 2, material=materials[kind])
    number = O.bodies.append(body)
    if kind == 1:
        moving.append(number)
for axis, places in ((0, (0.1,)), (1, (-0.05, 0.05)), (2, (-0.05, 0.05))):
    for place in places:
        O.bodies.append(wall(place, axis, material=materials[1]))
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], verletDist=0.0006),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_MindlinPhys(en=0.707)],
        [Law2_ScGeom_MindlinPhys_Mindlin()],
    ),
    *([LinearDragEngine(nu=0.001, ids=moving)] if drag else []),
    NewtonIntegrator(gravity=(0, 0, 0), damping=0),
]
O.dt = step
O.run(10, True)  # the first steps build the collider's lists
start = time.perf_counter()
O.run(steps, True)
print("seconds", time.perf_counter() - start)
