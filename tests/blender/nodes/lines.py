"""What the add-on writes for trees: lines, graphs, messages, bounds.

    blender -b --factory-startup -P lines.py -- PACKAGE FOLDER
"""
import json
import pathlib
import sys
import unittest

import bpy

package, folder = sys.argv[sys.argv.index("--") + 1:]
sys.path[:0] = [package, str(pathlib.Path(__file__).parent)]
from lightmill import nodes  # noqa: E402
from value_cases import Make  # noqa: E402


class Lines(unittest.TestCase):
    def setUp(self):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.folder = pathlib.Path(folder)
        self.context = nodes.Context(self.folder, bpy.context.scene, bpy.context.evaluated_depsgraph_get())

    def material(self, name="m"):
        """An empty tree with an output; gives the material, its builder and the output node."""
        material = bpy.data.materials.new(name)
        material.use_nodes = True
        material.node_tree.nodes.clear()
        m = Make(material.node_tree, None)
        return material, m, m.add("OutputMaterial")

    def surface(self, material, **place):
        return nodes.surface(material, self.context, nodes.Place(**place))

    def last(self, found):
        return next(line for line in found.lines if line.startswith(f'MakeNamedMaterial "{found.name}"'))

    def graph(self, text):
        """The graph that a texture line or a parameter names."""
        name = next(part for part in text.split('"') if part[:2] in ("s_", "f_"))
        return json.loads((self.folder / "graphs" / f"{name[2:]}.json").read_text())

    def messages(self):
        return [str(m) for m in self.context.report.messages]

    def single(self, kind, **values):
        material, m, output = self.material()
        node = m.add(kind, **values)
        m.tree.links.new(node.outputs[0], output.inputs["Surface"])
        return material, m, node

    # Shaders.

    def test_no_material_and_no_nodes(self):
        self.assertIn('"diffuse_bsdf" "rgb color" [0.8 0.8 0.8]', self.last(self.surface(None)))
        material = bpy.data.materials.new("plain")
        material.diffuse_color = (0.5, 0.25, 2, 1)
        self.assertIn('"diffuse_bsdf" "rgb color" [0.5 0.25 1]', self.last(self.surface(material)))

    def test_principled_writes_what_is_set(self):
        material, _, node = self.single("BsdfPrincipled")
        self.assertEqual(self.last(self.surface(material)).split(" ", 2)[2], '"string type" "principled" "rgb base_color" [0.800000012 0.800000012 0.800000012]')
        node.inputs["Metallic"].default_value, node.inputs["Subsurface"].default_value, node.distribution = 0.75, 0.5, "MULTI_GGX"
        other = nodes.Context(self.folder, bpy.context.scene)
        line = self.last(nodes.surface(material, other))
        for part in ('"float metallic" 0.75', '"float subsurface" 0.5', '"rgb subsurface_radius" [1 0.200000003 0.100000001]', '"string distribution" "multi_ggx"'):
            self.assertIn(part, line)

    def test_alpha_and_emission(self):
        material, _, node = self.single("BsdfPrincipled", Alpha=0.25)
        node.inputs["Emission"].default_value, node.inputs["Emission Strength"].default_value = (1, 0.5, 0, 1), 8
        found = self.surface(material)
        self.assertIn('"mix_bsdf"', self.last(found))
        self.assertIn('"float factor" 0.25', self.last(found))
        self.assertEqual(found.emission.parameters, '"rgb L" [2 1 0] "bool twosided" true')

    def test_every_shader(self):
        for kind, type_ in (("BsdfDiffuse", "diffuse_bsdf"), ("BsdfGlossy", "glossy_bsdf"), ("BsdfAnisotropic", "glossy_bsdf"), ("BsdfGlass", "glass_bsdf"),
                            ("BsdfRefraction", "refraction_bsdf"), ("BsdfTranslucent", "translucent_bsdf"), ("BsdfTransparent", "transparent_bsdf"),
                            ("BsdfVelvet", "velvet_bsdf"), ("BsdfToon", "toon_bsdf"), ("SubsurfaceScattering", "subsurface_bsdf"), ("BsdfHair", "hair_bsdf"),
                            ("BsdfHairPrincipled", "principled_hair_bsdf"), ("Holdout", "holdout")):
            self.assertIn(f'"string type" "{type_}"', self.last(self.surface(self.single(kind)[0])), kind)
        self.assertEqual(self.messages(), [])

    def test_mix_folds_and_adds(self):
        material, m, output = self.material()
        mix, add = m.add("MixShader", Fac=1), m.add("AddShader")
        glossy, diffuse, emission = m.add("BsdfGlossy"), m.add("BsdfDiffuse"), m.add("Emission", Strength=3)
        for a, b in ((glossy, mix.inputs[1]), (diffuse, mix.inputs[2]), (mix, add.inputs[0]), (emission, add.inputs[1]), (add, output.inputs[0])):
            m.tree.links.new(a.outputs[0], b)
        found = self.surface(material)
        self.assertIn('"diffuse_bsdf"', self.last(found))
        self.assertIn('"rgb L" [3 3 3]', found.emission.parameters)

    def emitting_mix(self, factor_of):
        material, m, output = self.material()
        mix = m.add("MixShader")
        m.tree.links.new(factor_of(m), mix.inputs[0])
        m.tree.links.new(m.add("Emission", Strength=2).outputs[0], mix.inputs[1])
        m.tree.links.new(m.add("BsdfTransparent").outputs[0], mix.inputs[2])
        m.tree.links.new(mix.outputs[0], output.inputs[0])
        return self.surface(material)

    def test_emission_of_one_side_or_some_rays(self):
        found = self.emitting_mix(lambda m: m.add("NewGeometry").outputs["Backfacing"])
        self.assertEqual((found.emission.two_sided, found.emission.parameters), (False, '"rgb L" [2 2 2] "bool twosided" false'))
        found = self.emitting_mix(lambda m: m.add("LightPath").outputs["Is Camera Ray"])
        self.assertEqual(found.emission.hidden, ("camera",))

    def test_emission_times_a_factor_that_varies(self):
        found = self.emitting_mix(lambda m: m.add("TexNoise").outputs["Fac"])
        self.assertIn('"texture L"', found.emission.parameters)
        graph = self.graph(found.emission.parameters)
        self.assertEqual(graph["nodes"][0]["type"], "TEX_NOISE")
        self.assertEqual(found.uses, {"generated"})

    # Sharing.

    def test_places_share_what_is_alike(self):
        material, m, output = self.material()
        noise = m.add("TexNoise", {"Vector": m.coordinates("Object")})
        m.tree.links.new(m.add("BsdfDiffuse", {"Color": noise.outputs["Color"]}).outputs[0], output.inputs[0])
        from mathutils import Matrix

        a, b = self.surface(material, name="a"), self.surface(material, name="b")
        self.assertIs(a, b)
        moved = self.surface(material, matrix_world=Matrix.Translation((1, 2, 3)))
        self.assertNotEqual(a.name, moved.name)
        texture = next(line for line in moved.lines if line.startswith("Texture"))
        self.assertEqual(self.graph(texture)["spaces"]["object"], [1, 0, 0, -1, 0, 1, 0, -2, 0, 0, 1, -3, 0, 0, 0, 1])

    def test_equal_materials_have_one_name(self):
        names = {self.surface(self.single("BsdfDiffuse")[0]).name for _ in range(3)}
        self.assertEqual(len(names), 1)

    def test_second_uv_map_and_needs(self):
        material, m, output = self.material()
        image = bpy.data.images.new("i", 2, 2)
        texture = m.add("TexImage", {"Vector": m.add("UVMap", uv_map="Two").outputs[0]}, image=image)
        color = m.add("VertexColor", layer_name="Col")
        mixed = m.add("MixRGB", {"Color1": texture.outputs[0], "Color2": color.outputs[0]})
        m.tree.links.new(m.add("BsdfDiffuse", {"Color": mixed.outputs[0]}).outputs[0], output.inputs[0])
        self.assertEqual(nodes.needs(material), nodes.Needs(("Two",), ("Col",)))
        found = self.surface(material, uv_maps=("One", "Two"), attribute="Col")
        graph = self.graph(next(line for line in found.lines if line.startswith("Texture")))
        self.assertEqual(next(n for n in graph["nodes"] if n["type"] == "UVMAP")["uv_set"], 1)
        self.assertEqual(self.messages(), [])

    # Normals.

    def bumped(self, build):
        material, m, output = self.material()
        m.tree.links.new(m.add("BsdfDiffuse", {"Normal": build(m)}).outputs[0], output.inputs[0])
        return self.last(self.surface(material, uv_maps=("UVMap",)))

    def test_bumps_add_up(self):
        def build(m):
            noise = m.add("TexNoise")
            first = m.add("Bump", {"Height": noise.outputs[0]}, Distance=0.5)
            return m.add("Bump", {"Height": m.add("TexMagic").outputs[1], "Normal": first.outputs[0]}, invert=True, Strength=0.5).outputs[0]

        line = self.bumped(build)
        self.assertIn('"texture displacement"', line)
        self.assertNotIn("bump_strength", line)  # they differ: each height has its own
        types = [n["type"] for n in self.graph(line[line.index("displacement"):])["nodes"]]
        self.assertEqual(sorted(types), ["MATH", "MATH", "MATH", "MATH", "TEX_MAGIC", "TEX_NOISE"])

    def test_strength_of_a_bump(self):
        def build(m, strength=None, **values):
            links = {"Height": m.add("TexNoise").outputs[0], **({"Strength": strength} if strength else {})}
            return m.add("Bump", links, **values).outputs[0]

        self.assertIn('"float bump_strength" 0.25', self.bumped(lambda m: build(m, Strength=0.25)))
        self.assertNotIn("bump_strength", self.bumped(lambda m: build(m, Strength=1)))
        self.assertIn('"texture bump_strength"', self.bumped(lambda m: build(m, m.add("TexMagic").outputs[1])))

    # Tangents.

    def test_anisotropic_lobes_have_a_tangent(self):
        def line(kind, tangent=None, **values):
            material, m, output = self.material()
            links = {"Tangent": m.add("Tangent", **tangent).outputs[0]} if tangent else {}
            m.tree.links.new(m.add(kind, links, **values).outputs[0], output.inputs[0])
            return self.last(self.surface(material, uv_maps=("UVMap",)))

        self.assertIn('"texture tangent"', line("BsdfAnisotropic", Anisotropy=0.5))
        self.assertIn('"texture tangent"', line("BsdfPrincipled", {"direction_type": "RADIAL", "axis": "X"}, Anisotropic=0.5))
        self.assertNotIn("tangent", line("BsdfPrincipled", {"direction_type": "UV_MAP"}, Anisotropic=0.5))
        self.assertNotIn("tangent", line("BsdfAnisotropic", Anisotropy=0))
        self.assertNotIn("tangent", line("BsdfPrincipled"))
        self.assertEqual(self.messages(), [])

    def test_values_that_the_exporter_makes(self):
        material, m, output = self.material()
        m.tree.links.new(m.add("BsdfDiffuse", {"Color": m.add("NewGeometry").outputs["Pointiness"]}).outputs[0], output.inputs[0])
        self.assertEqual(nodes.needs(material).attributes, (".pointiness",))
        found = self.surface(material, attribute=".pointiness")
        self.assertEqual([n["type"] for n in self.graph(next(x for x in found.lines if x.startswith("Texture")))["nodes"]][0], "ATTRIBUTE")
        self.assertEqual(self.messages(), [])

    def test_normal_maps(self):
        image = bpy.data.images.new("normals", 4, 4)
        image.colorspace_settings.name = "Non-Color"

        def plain(m, **values):
            return m.add("NormalMap", {"Color": m.add("TexImage", image=image).outputs[0]}, **values).outputs[0]

        self.assertIn('"string normalmap" "images/', self.bumped(plain))
        self.assertIn('"texture normalmap"', self.bumped(lambda m: plain(m, Strength=0.5)))
        self.assertIn('"texture normal"', self.bumped(lambda m: plain(m, space="OBJECT")))
        self.assertNotIn("normal", self.bumped(lambda m: m.add("NewGeometry").outputs["Normal"]))

    def test_displacement_output(self):
        material, m, output = self.material()
        m.tree.links.new(m.add("BsdfDiffuse").outputs[0], output.inputs[0])
        displacement = m.add("Displacement", {"Height": m.add("TexNoise").outputs[0]}, Scale=0.1)
        m.tree.links.new(displacement.outputs[0], output.inputs["Displacement"])
        for method, bump, moves in (("BUMP", True, False), ("DISPLACEMENT", False, True), ("BOTH", True, True)):
            material.cycles.displacement_method = method
            self.context.surfaces.clear()
            found = self.surface(material)
            self.assertEqual('"texture displacement"' in self.last(found), bump)
            self.assertEqual('"texture displacement"' in found.displacement, moves)
        self.assertEqual(self.messages(), [])

    # Media.

    def volume(self, build, grid=None):
        material, m, output = self.material()
        m.tree.links.new(build(m), output.inputs["Volume"])
        return nodes.volume(material, self.context, nodes.Place(), grid), material

    def test_homogeneous_media(self):
        medium, material = self.volume(lambda m: m.add("VolumeScatter", Density=0.5, Anisotropy=0.25, Color=(1, 0.5, 0.25, 1)).outputs[0])
        self.assertIn('"homogeneous" "rgb sigma_s" [0.5 0.25 0.125] "rgb sigma_a" [0 0 0] "float g" 0.25', medium.lines[0])
        self.assertIn('"interface"', self.last(self.surface(material)))
        medium, _ = self.volume(lambda m: m.add("VolumeAbsorption", Density=2, Color=(1, 0.5, 0.25, 1)).outputs[0])
        self.assertIn('"rgb sigma_s" [0 0 0] "rgb sigma_a" [0 1 1.5]', medium.lines[0])
        medium, _ = self.volume(lambda m: m.add("VolumePrincipled", Density=2, Color=(0.5, 0.5, 0.5, 1), **{"Emission Strength": 3, "Emission Color": (1, 0, 0, 1)}).outputs[0])
        self.assertIn('"rgb sigma_s" [1 1 1] "rgb sigma_a" [1 1 1] "float g" 0 "rgb Le" [3 0 0]', medium.lines[0])

    def test_grids(self):
        grid = nodes.Grid("volumes/smoke.vdb", ("density",))
        medium, _ = self.volume(lambda m: m.add("VolumePrincipled", Density=2).outputs[0], grid)
        self.assertIn('"string type" "vdb" "string filename" "volumes/smoke.vdb" "string gridname" "density" "rgb sigma_s" [1 1 1]', medium.lines[0])

        def scaled(m):
            density = m.add("Attribute", attribute_name="density").outputs["Fac"]
            return m.add("VolumeScatter", {"Density": m.add("Math", {"Value": density}, operation="MULTIPLY", Value_001=5).outputs[0]}, Color=(1, 1, 1, 1)).outputs[0]

        medium, _ = self.volume(scaled, grid)
        self.assertIn('"rgb sigma_s" [5 5 5]', medium.lines[0])
        self.assertEqual(self.messages(), [])

    # Lamps.

    def test_lamps(self):
        lamp = bpy.data.lights.new("lamp", "POINT")
        self.assertEqual(nodes.light(lamp, self.context).rgb, (1, 1, 1))
        lamp.use_nodes = True
        m = Make(lamp.node_tree, None)
        emission = lamp.node_tree.nodes["Emission"]
        emission.inputs["Strength"].default_value = 2
        lamp.node_tree.links.new(m.add("Blackbody", Temperature=4000).outputs[0], emission.inputs["Color"])
        rgb = nodes.light(lamp, self.context).rgb
        luminance = sum(a * b for a, b in zip(rgb, (0.2126729, 0.7151522, 0.0721750)))
        self.assertAlmostEqual(luminance, 2, delta=0.01)
        self.assertGreater(rgb[0], 2 * rgb[2])
        self.assertEqual(self.messages(), [])

    # Bad trees.

    def test_what_is_not_supported_is_named_once(self):
        material, m, output = self.material('a "name" / \\ \u96ea')
        color = m.add("TexPointDensity").outputs[0]
        mixed = m.add("MixRGB", {"Color1": color, "Color2": m.add("TexPointDensity").outputs[0]})
        m.tree.links.new(m.add("BsdfDiffuse", {"Color": mixed.outputs[0]}).outputs[0], output.inputs[0])
        found = self.surface(material)
        self.assertEqual(len(self.messages()), 1)
        self.assertIn("Point Density is not supported", self.messages()[0])
        self.assertTrue(all(ord(c) < 128 for c in "".join(found.lines)))

    def test_deep_trees(self):
        material, m, output = self.material()
        shader, value = m.add("BsdfDiffuse"), m.add("TexNoise")
        for _ in range(300):
            shader, mix = m.add("MixShader", Fac=0.5), shader
            m.tree.links.new(mix.outputs[0], shader.inputs[1])
        for _ in range(1030):
            value, last = m.add("Math", operation="SINE"), value
            m.tree.links.new(last.outputs[0], value.inputs[0])
        m.tree.links.new(value.outputs[0], shader.inputs[0])
        m.tree.links.new(shader.outputs[0], output.inputs[0])
        self.surface(material)
        self.assertEqual(len(self.messages()), 1)
        self.assertIn("more than 1024 nodes", self.messages()[0])

    def test_cycles_end(self):
        material, m, output = self.material()
        a = m.add("MixRGB")
        b = m.add("MixRGB", {"Color1": a.outputs[0]})
        m.tree.links.new(b.outputs[0], a.inputs["Color1"])
        m.tree.links.new(m.add("BsdfDiffuse", {"Color": b.outputs[0]}).outputs[0], output.inputs[0])
        self.surface(material)

    def test_normal_maps_of_one_colour(self):
        for color, is_written in (((0.5, 0.5, 1, 1), False), ((1, 0, 1, 1), True)):
            material, m, node = self.single("BsdfDiffuse", name=f"d{is_written}")
            m.tree.links.new(m.add("NormalMap", Color=color).outputs[0], node.inputs["Normal"])
            self.assertEqual("normalmap" in self.last(self.surface(material)), is_written)

    def test_bodies_of_a_radius_of_0(self):
        # Cycles draws a colour whose radius is 0 as diffuse. A walk needs a way to go.
        material, m, node = self.single("BsdfPrincipled", Subsurface=0.5)
        node.inputs["Subsurface Radius"].default_value = (0, 0.09, 0.09)
        self.assertIn('"rgb subsurface_radius" [0.0009', self.last(self.surface(material)))
        node.inputs["Subsurface Radius"].default_value = (0, 0, 0)
        node.inputs["Base Color"].default_value, node.inputs["Subsurface Color"].default_value = (0.5, 0, 0, 1), (0, 1, 0.5, 1)
        flat = self.last(nodes.surface(material, nodes.Context(self.folder, bpy.context.scene)))
        self.assertIn('"rgb base_color" [0.25 0.5 0.25]', flat)
        self.assertNotIn("subsurface", flat)
        material, m, node = self.single("SubsurfaceScattering")
        node.inputs["Radius"].default_value = (0, 0, 0)
        self.assertIn('"diffuse_bsdf"', self.last(self.surface(material)))

    def test_missing_groups_and_images(self):
        material, m, output = self.material()
        group = m.add("Group")
        image = bpy.data.images.new("gone", 2, 2)
        image.source, image.filepath = "FILE", "//not/there.png"
        texture = m.add("TexImage", image=image)
        m.tree.links.new(m.add("BsdfDiffuse", {"Color": texture.outputs[0]}).outputs[0], output.inputs[0])
        self.assertIn('"rgb color" [1 0 1]', self.last(self.surface(material)))
        m.tree.nodes.remove(group)
        self.assertEqual(len(self.messages()), 1)
        self.assertIn("is missing", self.messages()[0])

    def test_missing_images_of_worlds_are_said_once(self):
        world = bpy.data.worlds.new("w")
        world.use_nodes = True
        world.node_tree.nodes.clear()
        m = Make(world.node_tree, None)
        image = bpy.data.images.new("gone", 2, 2)
        image.source, image.filepath = "FILE", "//not/there.hdr"
        sky = m.add("TexEnvironment", image=image)
        mix = m.add("MixShader", {"Fac": m.add("LightPath").outputs["Is Camera Ray"], "Shader": m.add("Background", {"Color": sky.outputs[0]}).outputs[0]})
        m.tree.links.new(mix.outputs[0], m.add("OutputWorld").inputs["Surface"])
        self.assertIn('"rgb L" [1 0 1]', "".join(nodes.world(world, self.context).lines))
        self.assertEqual(len(self.messages()), 1, self.messages())
        self.assertIn("the image 'gone' is missing", self.messages()[0])

    def test_no_output(self):
        material, m, output = self.material()
        m.tree.nodes.remove(output)
        self.assertIn('"rgb color" [0 0 0]', self.last(self.surface(material)))
        output = m.add("OutputMaterial", target="EEVEE")
        m.tree.links.new(m.add("BsdfGlossy").outputs[0], output.inputs[0])
        cycles = m.add("OutputMaterial", target="CYCLES")
        m.tree.links.new(m.add("BsdfToon").outputs[0], cycles.inputs[0])
        other = nodes.Context(self.folder, bpy.context.scene)
        self.assertIn('"toon_bsdf"', self.last(nodes.surface(material, other)))


result = unittest.TextTestRunner(stream=sys.stdout, verbosity=1).run(unittest.defaultTestLoader.loadTestsFromTestCase(Lines))
if not result.wasSuccessful():
    sys.exit(1)
