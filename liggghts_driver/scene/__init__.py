"""The scene file: its tables, how it is read, and the geometry that follows from it."""

from liggghts_driver.scene.layout import Layout, layout
from liggghts_driver.scene.model import Scene
from liggghts_driver.scene.read import make_scene, read_problem, read_scene

__all__ = ["Layout", "Scene", "layout", "make_scene", "read_problem", "read_scene"]
