"""Our materials of Blender's shader nodes (docs/blender-materials.md) against Cycles: the same ball on a floor under a sun and
a sky, rendered by Cycles and through a pbrt file written here, without the exporter.

    materials_test.py --bin build/release/bin [NAME...]

For each material two figures: the mean over Cycles' mean, and the error of 4x4 box means, mean((a-b)^2 / (a^2 + 1e-3)).
Skipped (exit 77) where there is no blender. Exit 1 if a material is not within what LIMITS says.
"""
import argparse
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile

SIZE, SAMPLES = 96, 256
LIMITS = (0.03, 0.01)
FAR = {}  # materials that are only near, and by how much: name: (mean, error)


class Node:
    """A shader: Blender's node and its sockets by our names."""
    def __init__(self, kind, **sockets):
        self.kind, self.sockets = kind, sockets


class Graph:
    """A number by a texture graph of one node."""
    def __init__(self, kind, output, **inputs):
        self.kind, self.output, self.inputs = kind, output, inputs


def mix(factor, a, b):
    return Node("mix_bsdf", factor=factor, parts=(a, b))


def add(a, b):
    return Node("add_bsdf", parts=(a, b))


RED, GOLD, WHITE = (0.8, 0.2, 0.1), (0.9, 0.6, 0.2), (0.8, 0.8, 0.8)
P = "principled"
red, gloss = Node("diffuse_bsdf", color=RED), Node("glossy_bsdf", color=WHITE, roughness=0.2)
MATERIALS = {
    "principled": Node(P, base_color=RED),
    "principled_smooth": Node(P, base_color=RED, roughness=0.1),
    "principled_rough": Node(P, base_color=RED, roughness=1.0, specular=0.0),
    "principled_metal": Node(P, base_color=GOLD, metallic=1.0, roughness=0.3),
    "principled_half": Node(P, base_color=GOLD, metallic=0.5, specular_tint=0.8),
    "principled_sheen": Node(P, base_color=RED, sheen=1.0, sheen_tint=0.5),
    "principled_coat": Node(P, base_color=RED, clearcoat=1.0, clearcoat_roughness=0.1),
    "principled_glass": Node(P, base_color=GOLD, transmission=1.0, roughness=0.0),
    "principled_glass_rough": Node(P, base_color=GOLD, transmission=1.0, roughness=0.2, transmission_roughness=0.3),
    "principled_glass_half": Node(P, base_color=GOLD, transmission=0.5, roughness=0.3, clearcoat=0.5),
    "principled_multi": Node(P, base_color=GOLD, metallic=1.0, roughness=0.6, distribution="multi_ggx"),
    "principled_subsurface": Node(P, base_color=RED, subsurface=0.2, subsurface_color=RED),
    "diffuse": Node("diffuse_bsdf", color=RED),
    "diffuse_rough": Node("diffuse_bsdf", color=RED, roughness=0.8),
    "glossy": Node("glossy_bsdf", color=GOLD, roughness=0.3),
    "glossy_sharp": Node("glossy_bsdf", color=GOLD, distribution="sharp"),
    "glossy_beckmann": Node("glossy_bsdf", color=GOLD, roughness=0.4, distribution="beckmann"),
    "glossy_ashikhmin": Node("glossy_bsdf", color=GOLD, roughness=0.4, distribution="ashikhmin_shirley"),
    "glossy_multi": Node("glossy_bsdf", color=GOLD, roughness=0.7, distribution="multi_ggx"),
    "glass": Node("glass_bsdf", color=WHITE, ior=1.45),
    "glass_rough": Node("glass_bsdf", color=GOLD, roughness=0.3, ior=1.45),
    "glass_beckmann": Node("glass_bsdf", color=GOLD, roughness=0.3, ior=1.45, distribution="beckmann"),
    "glass_multi": Node("glass_bsdf", color=GOLD, roughness=0.6, ior=1.45, distribution="multi_ggx"),
    "refraction": Node("refraction_bsdf", color=GOLD, roughness=0.2, ior=1.45),
    "translucent": Node("translucent_bsdf", color=GOLD),
    "transparent": Node("transparent_bsdf", color=WHITE),
    "transparent_tinted": Node("transparent_bsdf", color=(0.9, 0.5, 0.2)),
    "velvet": Node("velvet_bsdf", color=RED, sigma=0.6),
    "toon": Node("toon_bsdf", color=RED, size=0.5, smooth=0.2),
    "toon_glossy": Node("toon_bsdf", color=RED, size=0.4, smooth=0.2, component="glossy"),
    "subsurface": Node("subsurface_bsdf", color=RED, scale=0.2, radius=(1.0, 0.5, 0.25)),
    "mix": mix(0.3, red, gloss),
    "mix_alpha": mix(0.6, Node("transparent_bsdf", color=(1, 1, 1)), red),
    "mix_nested": mix(0.5, mix(0.4, Node("transparent_bsdf", color=(1, 1, 1)), gloss), red),
    "add": add(red, gloss),
    "mix_fresnel": mix(Graph("FRESNEL", "Fac", IOR=1.45), red, gloss),
    "mix_facing": mix(Graph("LAYER_WEIGHT", "Facing", Blend=0.3), red, gloss),
    "mix_layer": mix(Graph("LAYER_WEIGHT", "Fresnel", Blend=0.4), red, gloss),
    "mix_fresnel_transparent": mix(Graph("FRESNEL", "Fac", IOR=1.45), Node("transparent_bsdf", color=(1, 1, 1)), gloss),
    "mix_camera_ray": mix(Graph("LIGHT_PATH", "Is Camera Ray"), gloss, red),
    "mix_shadow_ray": mix(Graph("LIGHT_PATH", "Is Shadow Ray"), Node("glass_bsdf", color=WHITE, ior=1.45),
                          Node("transparent_bsdf", color=WHITE)),
    "mix_backfacing": mix(Graph("NEW_GEOMETRY", "Backfacing"), red, gloss),
}
NODES = {"principled": "ShaderNodeBsdfPrincipled", "diffuse_bsdf": "ShaderNodeBsdfDiffuse",
         "glossy_bsdf": "ShaderNodeBsdfGlossy", "glass_bsdf": "ShaderNodeBsdfGlass",
         "refraction_bsdf": "ShaderNodeBsdfRefraction", "translucent_bsdf": "ShaderNodeBsdfTranslucent",
         "transparent_bsdf": "ShaderNodeBsdfTransparent", "velvet_bsdf": "ShaderNodeBsdfVelvet",
         "toon_bsdf": "ShaderNodeBsdfToon", "subsurface_bsdf": "ShaderNodeSubsurfaceScattering",
         "mix_bsdf": "ShaderNodeMixShader", "add_bsdf": "ShaderNodeAddShader", "FRESNEL": "ShaderNodeFresnel",
         "LAYER_WEIGHT": "ShaderNodeLayerWeight", "LIGHT_PATH": "ShaderNodeLightPath",
         "NEW_GEOMETRY": "ShaderNodeNewGeometry"}
WORDS = ("distribution", "component")
EYE, FOV, SUN, STRENGTH, SKY = (0, -5.5, 2.2), 36.0, (0.5, -0.4, 0.9), 2.0, 0.4


# --- as pbrt ------------------------------------------------------------------------------------------
class Pbrt:
    def __init__(self, folder):
        self.folder, self.lines, self.count = folder, [], 0

    def name(self, letter):
        self.count += 1
        return f"{letter}{self.count}"

    def value(self, name, given):
        if isinstance(given, Graph):
            texture = self.name("t")
            node = {"name": "n", "type": given.kind, "inputs": given.inputs}
            with open(os.path.join(self.folder, texture + ".json"), "w") as file:
                json.dump({"texture_graph": 1, "nodes": [node], "output": ["n", given.output]}, file)
            self.lines.append(f'Texture "{texture}" "float" "graph" "string filename" "{texture}.json"')
            return f'"texture {name}" "{texture}"'
        if isinstance(given, str):
            return f'"string {name}" "{given}"'
        if isinstance(given, tuple):
            return f'"rgb {name}" [{" ".join(map(str, given))}]'
        return f'"float {name}" {given}'

    def material(self, node):
        sockets = dict(node.sockets)
        parts = [self.material(part) for part in sockets.pop("parts", ())]
        values = [self.value(*socket) for socket in sockets.items()]
        if parts:
            values.append(f'"string materials" ["{parts[0]}" "{parts[1]}"]')
        name = self.name("m")
        self.lines.append(f'MakeNamedMaterial "{name}" "string type" "{node.kind}" {" ".join(values)}')
        return name


def write_pbrt(folder, node, ball, floor):
    out = Pbrt(folder)
    length = math.sqrt(sum(x * x for x in SUN))
    sun = [x / length for x in SUN]
    name = out.material(node)
    head = [f"Scale -1 1 1 LookAt {EYE[0]} {EYE[1]} {EYE[2]}  0 0 0.1  0 0 1",
            f'Camera "perspective" "float fov" {FOV}', 'PixelFilter "box"',
            f'Film "rgb" "integer xresolution" {SIZE} "integer yresolution" {SIZE} "string filename" "out.exr"',
            'Integrator "path" "integer maxdepth" 33', "WorldBegin",
            f'LightSource "infinite" "rgb L" [{SKY} {SKY} {SKY}]',
            f'LightSource "distant" "point3 from" [{sun[0]} {sun[1]} {sun[2]}] "point3 to" [0 0 0] '
            f'"rgb L" [{STRENGTH} {STRENGTH} {STRENGTH}]']
    tail = ['MakeNamedMaterial "floor" "string type" "diffuse" "rgb reflectance" [0.4 0.45 0.5]', 'NamedMaterial "floor"',
            floor, f'NamedMaterial "{name}"', ball]
    path = os.path.join(folder, "scene.pbrt")
    with open(path, "w") as file:
        file.write("\n".join(head + out.lines + tail) + "\n")
    return path


def shape_of(mesh, smooth):
    points = " ".join(f"{x:.7g}" for v in mesh.vertices for x in v.co)
    mesh.calc_loop_triangles()
    indices = " ".join(str(i) for t in mesh.loop_triangles for i in t.vertices)
    normals = ' "normal N" [' + " ".join(f"{x:.7g}" for v in mesh.vertices for x in v.normal) + "]" if smooth else ""
    return f'Shape "trianglemesh" "point3 P" [{points}] "integer indices" [{indices}]{normals}'


# --- in Blender ---------------------------------------------------------------------------------------
def in_blender(program, names, folder):
    import bpy
    import mathutils
    import numpy as np

    def linked(tree, socket, given):
        if isinstance(given, Graph):
            node = tree.nodes.new(NODES[given.kind])
            for name, value in given.inputs.items():
                node.inputs[name].default_value = value
            tree.links.new(node.outputs[given.output], socket)
        elif isinstance(given, tuple) and len(socket.default_value) == 4:
            socket.default_value = (*given, 1)
        else:
            socket.default_value = given

    def shader(tree, node):
        made = tree.nodes.new(NODES[node.kind])
        for name, given in node.sockets.items():
            if name == "parts":
                first = len(made.inputs) - 2
                for k, part in enumerate(given):
                    tree.links.new(shader(tree, part).outputs[0], made.inputs[first + k])
            elif name in WORDS:
                setattr(made, name, given.upper())
            else:
                wanted = {"factor": "Fac", "base_color": "Base Color", "ior": "IOR"}.get(name)
                wanted = wanted or name.replace("_", " ").title()
                if wanted == "Subsurface Ior":
                    wanted = "Subsurface IOR"
                linked(tree, made.inputs[wanted], given)
        return made

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.samples, cycles.use_denoising, cycles.use_adaptive_sampling = SAMPLES * 2, False, False
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = 32
    cycles.transparent_max_bounces = 32
    cycles.sample_clamp_indirect = cycles.blur_glossy = cycles.light_sampling_threshold = 0
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    world = scene.world = bpy.data.worlds.new("world")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs[0].default_value = (SKY, SKY, SKY, 1)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64, radius=1)
    ball = bpy.context.object
    bpy.ops.object.shade_smooth()
    bpy.ops.mesh.primitive_plane_add(size=12, location=(0, 0, -1))
    bpy.ops.object.transform_apply()
    floor = bpy.context.object
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.sensor_width, camera.data.lens = 36, 18 / math.tan(math.radians(FOV) / 2)
    camera.location = EYE
    towards = mathutils.Vector((0, 0, 0.1)) - camera.location
    camera.rotation_euler = towards.to_track_quat("-Z", "Y").to_euler()
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.data.angle = STRENGTH, 0
    sun.rotation_euler = mathutils.Vector([-x for x in SUN]).to_track_quat("-Z", "Y").to_euler()
    for thing in (camera, sun):
        scene.collection.objects.link(thing)
    scene.camera = camera
    shapes = shape_of(ball.data, True), shape_of(floor.data, False)

    def material(name):
        made = bpy.data.materials.new(name)
        made.use_nodes = True
        made.node_tree.nodes.clear()
        return made

    def put(target, node):
        tree = target.node_tree
        out = tree.nodes.new("ShaderNodeOutputMaterial")
        tree.links.new(shader(tree, node).outputs[0], out.inputs[0])
        return target

    floor.data.materials.append(put(material("floor"), Node("diffuse_bsdf", color=(0.4, 0.45, 0.5))))

    def picture(path):
        image = bpy.data.images.load(path)
        pixels = np.array(image.pixels[:], dtype=np.float32).reshape(SIZE, SIZE, -1)[..., :3]
        bpy.data.images.remove(image)
        return pixels

    def boxes(a):
        return a.reshape(SIZE // 4, 4, SIZE // 4, 4, 3).mean((1, 3))

    bad = 0
    for name in names:
        ball.data.materials.clear()
        ball.data.materials.append(put(material(name), MATERIALS[name]))
        scene.render.filepath = os.path.join(folder, name + "-cycles")
        bpy.ops.render.render(write_still=True)
        here = os.path.join(folder, name)
        os.mkdir(here)
        ours = os.path.join(folder, name + "-ours.exr")
        done = subprocess.run([program, "render", write_pbrt(here, MATERIALS[name], *shapes), "-o", ours, "--spp",
                               str(SAMPLES), "-q"], capture_output=True, text=True)
        if done.returncode != 0:
            print(f"RESULT FAIL {name:26s} {done.stderr.strip()}", flush=True)
            bad += 1
            continue
        a, b = picture(os.path.join(folder, name + "-cycles.exr")), picture(ours)
        mean = b.mean() / a.mean()
        a, b = boxes(a), boxes(b)
        error = ((a - b) ** 2 / (a ** 2 + 1e-3)).mean()
        most_mean, most_error = FAR.get(name, LIMITS)
        good = abs(mean - 1) <= most_mean and error <= most_error
        bad += not good
        print(f"RESULT {'ok  ' if good else 'FAIL'} {name:26s} mean {mean:.4f} error {error:.5f}", flush=True)
    sys.exit(bad > 0)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True)
    parser.add_argument("--keep", help="a folder for the pictures and scenes")
    parser.add_argument("names", nargs="*")
    options = parser.parse_args()
    if not shutil.which("blender"):
        print("skipped: there is no blender")
        sys.exit(77)
    with tempfile.TemporaryDirectory() as folder:
        folder = options.keep or folder
        os.makedirs(folder, exist_ok=True)
        program = os.path.abspath(os.path.join(options.bin, "lightmill"))
        arguments = json.dumps([program, options.names or list(MATERIALS), os.path.abspath(folder)])
        done = subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", "1", "-P", __file__, "--", arguments],
                              capture_output=True, text=True)
        lines = [line[7:] for line in done.stdout.splitlines() if line.startswith("RESULT ")]
        print("\n".join(lines) if lines else done.stdout[-2000:] + done.stderr[-2000:])
        sys.exit(done.returncode)


if __name__ == "__main__":
    try:
        import bpy  # noqa: F401
        in_blender(*json.loads(sys.argv[sys.argv.index("--") + 1]))
    except ImportError:
        main()
