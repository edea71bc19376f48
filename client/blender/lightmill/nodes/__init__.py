"""Shader, world and lamp trees of Blender as lines of a pbrt file and texture graphs. See README.md."""
from .context import Context
from .emitters import Emission
from .lamps import LampColor, light
from .place import Place
from .report import Message, Report
from .surfaces import Needs, Surface, needs, surface, volume
from .media import Grid, Medium
from .worlds import World, world

__all__ = ["Context", "Emission", "Grid", "LampColor", "Medium", "Message", "Needs", "Place", "Report", "Surface", "World", "light", "needs",
           "surface", "volume", "world"]
