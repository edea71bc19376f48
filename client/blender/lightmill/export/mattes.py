"""What Cryptomatte calls things: Cycles' names of objects, materials and assets; and what the passes of indices number
them."""
import dataclasses

from .pbrt_text import quoted

DEFAULT_MATERIAL = "default_surface"  # Cycles' name where there is none


def asset_of(thing):
    """What an object hangs from at the top; itself if from nothing."""
    while thing.parent is not None:
        thing = thing.parent
    return thing


def names_of(thing):
    """Parameters that name and number a shape or an instance."""
    return (f' "string object" {quoted(thing.name)} "string asset" {quoted(asset_of(thing).name)}'
            f' "integer objectid" {thing.pass_index}')


def with_material(shading, material):
    """A Shading whose shapes say which material they have. The file's has a name of its own, as one of Blender's may be
    several there, or two the same."""
    name = material.name if material else DEFAULT_MATERIAL
    number = material.pass_index if material else 0
    line = f'Attribute "shape" "string materialname" {quoted(name)} "integer materialid" {number}\n'
    twin = shading.twin and dataclasses.replace(shading.twin, text=line + shading.twin.text)
    return dataclasses.replace(shading, text=line + shading.text, twin=twin)


def with_names(lines, names):
    """Directives of one thing, with `names` given to its shapes."""
    return [line.rstrip("\n") + names + "\n" if line.startswith("Shape ") else line for line in lines]
