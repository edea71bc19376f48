"""Materials by way of `nodes/`: what stands before a shape, and what its mesh must carry."""
from dataclasses import dataclass

from ..light_groups import parameter
from . import mesh_arrays, mesh_values
from .pbrt_text import quoted

# Of rays that may meet a light.
LIGHT_RAYS = ("camera", "diffuse", "glossy", "transmission", "volume_scatter")
MOST_OWN = 10_000  # places of materials that depend on the object
# Nodes that may look at texture coordinates or attributes of a mesh.
LOOKING = {"TEX_IMAGE", "TEX_COORD", "UVMAP", "NORMAL_MAP", "TANGENT", "ATTRIBUTE", "VERTEX_COLOR", "NEW_GEOMETRY"}


def has_node(tree, types):
    """Whether a node tree, or a group in it, has a node of one of the types."""
    trees, seen = [tree], set()
    while trees:
        tree = trees.pop()
        if tree is None or tree.as_pointer() in seen:
            continue
        seen.add(tree.as_pointer())
        for node in tree.nodes:
            if node.type in types:
                return True
            if node.type == "GROUP":
                trees.append(node.node_tree)
    return False


@dataclass(frozen=True)
class Shading:
    text: str  # NamedMaterial, AreaLightSource, MediumInterface
    emits: bool = False
    is_own: bool = False  # of one place alone
    displacement: str = ""  # parameters of its shapes
    volume: object = None  # nodes.Medium of what is inside
    hidden: tuple = ()  # kinds of rays that do not see a shape with it
    twin: "Shading | None" = None  # of a second shape in the same place, which those rays see


class Materials:
    """Definitions of materials, each written once."""

    def __init__(self, export):
        self.export = export
        self._written = set()
        self._looking = {}  # which materials look at meshes
        self.own_places = 0

    def write(self, lines):
        """Adds lines that are not in the file yet."""
        for line in lines:
            if line not in self._written:
                self._written.add(line)
                self.export.lines.append(line.rstrip("\n") + "\n")

    def mesh_needs(self, mesh, materials, owner):
        """(names of up to two uv maps, an attribute or "") that the materials look up, of those that the mesh has.
        What has no room is reported."""
        materials = [m for m in materials if m is not None and self._looks_at_mesh(m)]
        if not materials:
            # The pass UV shows the map that is active, whatever reads it.
            active = mesh_arrays.active_uv_layer(mesh) if getattr(self.export.view_layer, "use_pass_uv", False) else None
            return ((active.name,) if active else ()), ""
        needs = [self.export.nodes.needs(m) for m in dict.fromkeys(materials)]
        asked = [name for n in needs for name in (*n.uv_maps, *n.attributes)]
        active = mesh_arrays.active_uv_layer(mesh)
        maps = list(dict.fromkeys(([active.name] if active else []) + [a for a in asked if a in mesh.uv_layers]))
        attributes = [a or mesh_arrays.active_color(mesh) for n in needs for a in n.attributes]
        attributes = [a for a in dict.fromkeys(attributes) if a and (a in mesh.attributes and a not in mesh.uv_layers or a in mesh_values.NAMES)]
        if len(maps) > 2:
            self.export.report.warn("third uv map", owner, f'uses more than two UV maps; "{maps[2]}" is left out')
        if len(attributes) > 1:
            self.export.report.warn("second attribute", owner,
                                    f'uses more than one attribute; "{attributes[1]}" is left out')
        return tuple(maps[:2]), attributes[0] if attributes else ""

    def _looks_at_mesh(self, material):
        key = material.original.as_pointer()
        if key not in self._looking:
            self._looking[key] = has_node(material.node_tree, LOOKING) if material.use_nodes else False
        return self._looking[key]

    def find(self, material, place):
        """The shading of a material (None: Blender's default) at a place (nodes.Place)."""
        found = self.export.nodes.surface(material, self.export.context, place)
        self.write(found.lines)
        text, light = f"NamedMaterial {quoted(found.name)}\n", ""
        if found.emission:
            self.write(found.emission.lines)
            light = f'AreaLightSource "diffuse" {found.emission.parameters}{parameter(place.light_group)}\n'
        outside = self.export.outside
        if found.volume:
            self.write(found.volume.lines)
        if found.volume or outside:
            text += f"MediumInterface {quoted(found.volume.name if found.volume else outside)} {quoted(outside)}\n"
        facts = {"is_own": bool(found.uses - {"mesh", "light_group"}), "volume": found.volume, "displacement": found.displacement}
        if found.emission and found.emission.hidden:  # two shapes: one shines, and is not there for the rays that see the other
            hidden = found.emission.hidden
            seers = tuple(k for k in LIGHT_RAYS if k not in hidden)
            return Shading(text + light, emits=True, hidden=(*hidden, "shadow"), twin=Shading(text, hidden=seers, **facts), **facts)
        return Shading(text + light, emits=bool(found.emission), **facts)
