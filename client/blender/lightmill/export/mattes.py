"""What Cryptomatte calls things: Cycles' names of objects, materials and assets."""
import dataclasses

from .pbrt_text import quoted

DEFAULT_MATERIAL = "default_surface"  # Cycles' name where there is none


def asset_of(thing):
    """What an object hangs from at the top; itself if from nothing."""
    while thing.parent is not None:
        thing = thing.parent
    return thing


def names_of(thing):
    """Parameters that name a shape or an instance."""
    return f' "string object" {quoted(thing.name)} "string asset" {quoted(asset_of(thing).name)}'


def with_material(shading, material):
    """A Shading whose shapes say which material they have. The file's has a name of its own, as one of Blender's may be
    several there, or two the same."""
    name = material.name if material else DEFAULT_MATERIAL
    line = f'Attribute "shape" "string materialname" {quoted(name)}\n'
    twin = shading.twin and dataclasses.replace(shading.twin, text=line + shading.twin.text)
    return dataclasses.replace(shading, text=line + shading.text, twin=twin)


def with_names(lines, names):
    """Directives of one thing, with `names` given to its shapes."""
    return [line.rstrip("\n") + names + "\n" if line.startswith("Shape ") else line for line in lines]
