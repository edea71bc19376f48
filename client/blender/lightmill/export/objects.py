"""Everything that the depsgraph shows, as shapes and instances.

An evaluated object or a piece of geometry that is shown several times with the same materials is one object of the
scene file, and instances of it. What emits light, and what has materials that depend on the object, is written out
for each place: their mesh is the same file.
"""
import dataclasses
from dataclasses import dataclass, field

import numpy

from ..light_groups import group_of
from . import hair, mesh_arrays
from .lamps import hidden_parameter, lamp_lines
from .mattes import names_of, with_material, with_names
from .motion import instance_key, stands_still
from .pbrt_text import columns, is_usable, moving, quoted
from .ply import ply
from .points import SPHERE, spheres
from .shading import MOST_OWN, Shading
from .things import holds_out, identity, materials_of, particle_of
from .volumes import Overlaps, is_inside, volume_lines

MOST_INSTANCES = 8_000_000  # the reader's limit
NOT_DRAWN = {"CAMERA", "EMPTY", "ARMATURE", "LATTICE", "SPEAKER", "LIGHT_PROBE",
             # Their geometry comes as an instance of type MESH.
             "CURVE", "SURFACE", "FONT", "META"}
RAY_KINDS = ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow")

NO_TRIANGLES = numpy.empty((0, 3), "i4")
HOLDOUT = Shading('Material "holdout"\n')


@dataclass
class Geometry:
    """Shapes in the space of an object, and where they are."""

    name: str
    shapes: list = field(default_factory=list)  # (Shading, text of the shape)
    is_own: bool = False  # some material depends on the place
    emits: bool = False  # then it is no instance: each of its triangles is a light
    is_displaced: bool = False  # likewise: textures may say another height in each place
    places: list = field(default_factory=list)  # (way, kinds of rays that do not see it, names: mattes.names_of)


class Objects:
    def __init__(self, export, motion, clip=None, eye=None):
        """`eye`: where the camera stands, if that is the scene's; None: elsewhere."""
        self.export, self.materials, self.motion, self.clip, self.eye = export, export.materials, motion, clip, eye
        self.around_camera = None  # nodes.Medium of the object that the camera is in
        self.geometry = {}  # by data, materials and light group
        self._recent = {}  # the same, by object, data and light group: quicker to find
        self._files = {}  # of meshes: {slot: file}
        self._hidden = {}  # by object
        self._count = 0
        self._overlaps = Overlaps(export.report)
        self.lines = []  # of the world block, beside those of materials

    def add_all(self):
        for instance in self.export.depsgraph.object_instances:
            self.add(instance)
        for geometry in self.geometry.values():
            self._place(geometry)

    def add(self, instance):
        """Takes in one thing; what the depsgraph gives is gone after it."""
        thing = instance.object
        kind = thing.type
        if kind in NOT_DRAWN:
            return
        if kind not in ("MESH", "LIGHT", "CURVES", "VOLUME", "POINTCLOUD"):
            self.export.report.warn(f"object type {kind}", thing.name, f"objects of type {kind} are not drawn")
            return
        matrix = columns(instance.matrix_world)
        if not is_usable(matrix):
            self.export.report.warn("flat object", thing.name, "has a scale of 0 or is nowhere; it is left out")
            return
        self._count += 1
        if self._count > MOST_INSTANCES:
            self.export.report.warn("instances", thing.name, f"more than {MOST_INSTANCES} objects are left out")
            return
        way = (matrix,)
        if self.motion.steps and not stands_still(instance):
            way = self.motion.way(instance_key(instance), matrix)
            if not all(map(is_usable, way)):
                way = (matrix,)
        hidden = self.hidden_from(instance)
        if len(hidden) == len(RAY_KINDS):
            return
        if kind == "LIGHT":
            self.lines += with_names(lamp_lines(thing, way, hidden, group_of(thing, instance.parent), self.export), names_of(thing))
        elif kind == "VOLUME":
            self.lines += volume_lines(thing, way, hidden, self.export)
            self._overlaps.add(thing, way[0])
        elif kind == "POINTCLOUD":
            self._add_points(instance, thing, way, hidden)
        else:
            self._add_geometry(instance, thing, way, hidden)

    def _add_points(self, instance, thing, way, hidden):
        material = materials_of(thing)[0] if materials_of(thing) else None
        shading = self.materials.find(material, self.export.nodes.Place.of(thing, instance))
        if holds_out(thing, self.export.view_layer):
            shading = HOLDOUT
        shading = with_material(shading, material)
        cloud = Geometry(thing.name, shapes=[(shading, SPHERE)], emits=shading.emits)
        cloud.places = [(place, hidden, names_of(thing)) for place in spheres(thing, way, self.export.report)]
        self._place(cloud)

    def hidden_from(self, instance):
        """Kinds of rays that do not see an instance: those of its object and of what it is instanced by."""
        parent = instance.parent
        key = (instance.object.original.as_pointer(), parent.original.as_pointer() if parent else 0)
        if key not in self._hidden:
            things = [instance.object] + ([parent] if parent else [])
            kinds = [k for k in RAY_KINDS if not all(getattr(t, "visible_" + k) for t in things)]
            original = (parent or instance.object).original
            if original.indirect_only_get(view_layer=self.export.view_layer) and "camera" not in kinds:
                kinds.insert(0, "camera")
            if instance.object.type != "LIGHT" and any(t.is_shadow_catcher for t in things):
                self.export.report.warn("shadow catcher", instance.object.name, "shadow catchers are drawn as what they are")
            self._hidden[key] = tuple(kinds)
        return self._hidden[key]

    def _add_geometry(self, instance, thing, way, hidden):
        show = (instance.show_self, instance.show_particles)
        if not any(show):
            return
        if self.clip is not None and thing.type == "MESH" and len(way) == 1 and "camera" not in hidden:
            matrix = numpy.array(way[0]).reshape(4, 4).T
            if self.clip.touches(thing, matrix):
                geometry = self._shapes(instance, thing, way, hidden, matrix)
                self._note_volume(geometry, thing, way)
                self._place_once(geometry, way, hidden, names_of(thing))
                return
        group = group_of(thing, instance.parent)
        recent = (thing.original.as_pointer(), thing.data.as_pointer(), show, group)
        geometry = self._recent.get(recent)
        if geometry is None:
            materials = materials_of(thing)
            # Hair is the object's, not its mesh's.
            haired = thing.original.as_pointer() if len(thing.particle_systems) else 0
            key = (thing.data.as_pointer(), tuple(m.original.as_pointer() if m else 0 for m in materials), haired, show,
                   holds_out(thing, self.export.view_layer), group)
            geometry = self.geometry.get(key)
            if geometry is None:
                geometry = self.geometry[key] = self._shapes(instance, thing, way, hidden)
            self._recent[recent] = geometry
        self._note_volume(geometry, thing, way)
        if geometry.is_own and geometry.places:
            self.materials.own_places += 1
            if self.materials.own_places <= MOST_OWN:
                self._place_once(self._shapes(instance, thing, way, hidden), way, hidden, names_of(thing))
                return
            self.export.report.warn("materials of objects", thing.name, "has a material that depends on the object, as "
                                    f"{MOST_OWN} others do; further ones look as the first of them")
        if geometry.shapes:
            geometry.places.append((way, hidden, names_of(thing)))

    def _note_volume(self, geometry, thing, way):
        volume = next((s.volume for s, _ in geometry.shapes if s.volume), None)
        if volume:
            self._overlaps.add(thing, way[0])
            if self.eye is not None and is_inside(thing, way[0], self.eye):
                self.around_camera = volume

    def _shapes(self, instance, thing, way, hidden, cut=None):
        """The shapes of a thing, with the materials that it has here. `way`: see Motion. `hidden`: kinds of rays that do not
        see it, here; `cut`: its matrix, if the camera's clip planes cut it."""
        geometry = Geometry(thing.name)
        materials = materials_of(thing) or [None]
        held_out = holds_out(thing, self.export.view_layer)
        is_mesh = thing.type == "MESH" and instance.show_self and len(thing.data.polygons) > 0
        uv_maps, attribute = self.materials.mesh_needs(thing.data, materials, thing.name) if is_mesh else ((), "")
        place = self.export.nodes.Place.of(thing, instance, uv_maps=uv_maps, attribute=attribute,
                                           particle=particle_of(instance, self.export.scene))
        place.moving = moving(way) if len(way) > 1 else ""

        def shading(slot, at):
            material = materials[min(slot, len(materials) - 1)]
            found = HOLDOUT if held_out else self.materials.find(material, at)
            return with_material(found, material)

        if is_mesh:
            used = set(mesh_arrays.get(thing.data.polygons, "material_index", "i4").tolist())
            shadings = {slot: shading(slot, place) for slot in sorted({min(s, len(materials) - 1) for s in used})}
            if cut is None or any(s.volume for s in shadings.values()):  # a volume needs its whole hull
                files = [(slot, names, True) for slot, names in
                         self._mesh_files(thing, len(materials), uv_maps, attribute).items()]
            else:
                files = self._cut_files(thing, len(materials), uv_maps, attribute, cut)
            for slot, names, seen in files:
                more = self._later_or_displaced(thing, names, shadings[slot])
                for kind in filter(None, (shadings[slot], shadings[slot].twin)):
                    kinds = (*kind.hidden, *(() if seen else ("camera",)))
                    unseen = hidden_parameter(tuple(dict.fromkeys((*kinds, *hidden)))) if kinds else ""
                    geometry.shapes.append((kind, f'Shape "plymesh" "string filename" {quoted(names[0])}{more}{unseen}\n'))
        if thing.type == "CURVES" or (instance.show_particles and len(thing.particle_systems)):
            strand = dataclasses.replace(place, is_strand=True, uv_maps=(), attribute="")
            for slot, name, strands in hair.hair_of(thing, self.export.depsgraph.mode == "VIEWPORT"):
                file = hair.hair_file(("hair", identity(thing), name), strands, thing.name, self.export)
                if file:
                    geometry.shapes.append((shading(slot, strand), f"Include {quoted(file)}\n"))
        geometry.is_own = any(s.is_own for s, _ in geometry.shapes)
        geometry.emits = any(s.emits for s, _ in geometry.shapes)
        geometry.is_displaced = any(s.displacement for s, _ in geometry.shapes)
        return geometry

    def _later_or_displaced(self, thing, names, shading):
        """Parameters of a mesh that bends, or whose material moves its vertices."""
        if len(names) == 1:
            return shading.displacement
        if shading.displacement:
            self.export.report.warn("displaced bends", thing.name, "bends while the shutter is open; its displacement is left out")
        return f' "string later" [{" ".join(map(quoted, names[1:]))}]'

    def _mesh_files(self, thing, slots, uvs, color):
        """{slot: files of a mesh} of the slots that have triangles. The first file is the mesh, the others are its
        vertices later on."""
        bends = self.motion.bends.get(thing.original.as_pointer())
        if bends and thing.original.evaluated_get(self.export.depsgraph).data != thing.data:
            bends = None  # a piece of other geometry that the object makes
        known = (thing.data.as_pointer(), slots, uvs, color)
        if known not in self._files:
            self._files[known] = self._write_mesh(thing, slots, uvs, color, bends)
            for names in self._files[known].values():
                self.export.owners.update((name, thing.name) for name in names)
        return self._files[known]

    def _write_mesh(self, thing, slots, uvs, color, bends):
        export = self.export
        source = mesh_arrays.Source(thing.data, uvs, color or None)
        if bends and bends[0][0].shape != source.positions.shape:
            bends = None
        fingerprint = source.fingerprint() + tuple(mesh_arrays.digest(a) for step in bends or () for a in step)
        key = ("mesh", identity(thing), slots, uvs, color)
        files = export.cache.find(key, fingerprint, export.folder)
        if files is not None:
            return files
        files = {slot: self._part_files(part) for slot, part in self._parts(thing, source, slots, bends).items()}
        export.cache.store(key, fingerprint, files, [name for names in files.values() for name in names])
        return files

    def _parts(self, thing, source, slots, bends):
        """The triangles of each slot, with a report of those that are dropped."""
        repairs = mesh_arrays.Repairs()
        parts = mesh_arrays.triangles_by_slot(source, slots, repairs, bends)
        if repairs.not_finite:
            self.export.report.warn("vertices that are not finite", thing.name,
                                    f"{repairs.not_finite} triangles have vertices that are not finite; they are left out")
        if repairs.no_area:
            self.export.report.warn("faces without area", thing.name,
                                    f"{repairs.no_area} triangles have no area; they are left out")
        return parts

    def _part_files(self, part):
        write = self.export.folder.write
        return [write(ply(part.positions, part.triangles, **part.attributes), "meshes", "ply"),
                *(write(ply(positions, NO_TRIANGLES, normals=normals), "meshes", "ply") for positions, normals in part.later)]

    def _cut_files(self, thing, slots, uvs, color, matrix):
        """As _mesh_files, of a mesh of which the camera's clip planes hide something: [(slot, files, whether the camera
        sees it)]."""
        source = mesh_arrays.Source(thing.data, uvs, color or None)
        found = []
        for slot, part in self._parts(thing, source, slots, None).items():
            for piece, seen in zip(self.clip.split(part, matrix), (True, False)):
                if piece is not None:
                    found.append((slot, self._part_files(piece), seen))
        return found

    def _place(self, geometry):
        places = geometry.places
        if len(places) <= 1 or geometry.emits or geometry.is_displaced:
            for place in places:
                self._place_once(geometry, *place)
            return
        name = self.export.names.unique(geometry.name)
        lines = self.lines
        lines.append(f"ObjectBegin {quoted(name)}\n")
        lines += [f"AttributeBegin\n{shading.text}{text}AttributeEnd\n" for shading, text in geometry.shapes]
        lines.append("ObjectEnd\n")
        directive = f"ObjectInstance {quoted(name)}"
        for way, hidden, names in places:
            lines.append(f"{moving(way)}{directive}{hidden_parameter(hidden)}{names}\n")
        lines.append("Identity\n")

    def _place_once(self, geometry, way, hidden, names):
        lines = self.lines
        lines += ["AttributeBegin\n", moving(way), f'Attribute "shape"{hidden_parameter(hidden)}{names}\n']
        lines += [f"AttributeBegin\n{shading.text}{text}AttributeEnd\n" for shading, text in geometry.shapes]
        lines.append("AttributeEnd\n")
