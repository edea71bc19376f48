"""Light groups: Blender's have names of any characters, those of scene files and of channels (common/scene/lights/light_group_name.h) do
not."""
MOST_NAME = 64  # characters
REST = "rest"  # the layer of all light without a group


def name_of(group: str) -> str:
    """The name that a group of Blender has in scene files and pictures; "" for none. Characters beyond ASCII become their
    numbers, so that groups named in any script stay apart."""
    name = "".join(_plain(c) for c in group)[:MOST_NAME]
    if name.endswith("_difference"):
        return name[:-1] + "_"
    return f"{name}_" if name == REST else name


def _plain(character: str) -> str:
    if not character.isascii():
        return f"_{ord(character):x}"
    return character if character.isalnum() or character in "_-" else "_"


def group_of(thing: object, instancer: object = None) -> str:
    """The name for an object, or a world: its own, or that of what it is instanced by, as in Cycles. Blender has groups since
    3.2."""
    return name_of(getattr(thing, "lightgroup", "") or getattr(instancer, "lightgroup", ""))


def parameter(name: str) -> str:
    """Of LightSource, AreaLightSource and MakeNamedMedium, with a space before it."""
    return f' "string lightgroup" "{name}"' if name else ""
