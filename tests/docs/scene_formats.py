"""docs/scene-formats.md, made by asking the readers: every feature of a format's documentation as a small scene.

    scene_formats.py --bin build/release/bin            compares; exit 1 if the page is not what the readers say
    scene_formats.py --bin build/release/bin --write    writes the page
"""
import argparse
import json
import pathlib
import struct
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "scene-formats.md"

TRIANGLE = '"point3 P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 2]'
QUAD = '"point3 P" [0 0 0 1 0 0 0 1 0 1 1 0]'
BEZIER = '"point3 P" [0 0 0 0 1 0 1 1 0 1 0 0]'
SHAPES = {"bilinearmesh": QUAD, "curve": BEZIER, "cylinder": "", "disk": "", "loopsubdiv": TRIANGLE,
          "plymesh": '"string filename" "mesh.ply"', "sphere": "", "trianglemesh": TRIANGLE}
MATERIALS = {"coatedconductor": "", "coateddiffuse": "", "conductor": "", "dielectric": "", "diffuse": "",
             "diffusetransmission": "", "hair": "", "interface": "", "measured": '"string filename" "m.bsdf"',
             "mix": '"string materials" ["a" "b"]', "subsurface": "", "thindielectric": ""}
TEXTURES = {"bilerp": "", "checkerboard": "", "constant": "", "directionmix": "", "dots": "", "fbm": "",
            "graph": '"string filename" "graph.json"', "imagemap": '"string filename" "image.pfm"', "marble": "", "mix": "", "ptex": '"string filename" "p.ptx"',
            "scale": "", "windy": "", "wrinkled": ""}
FLOAT_ONLY, SPECTRUM_ONLY = ("fbm", "windy", "wrinkled"), ("marble",)
LIGHTS = {"area, a lamp": '"string shape" "ellipse" "float spread" 90', "distant": "", "goniometric": '"string filename" "image.pfm"', "infinite": "", "point": "",
          "projection": '"string filename" "image.pfm"', "spot": "",
          "infinite, with an image": '"string filename" "image.pfm"',
          "infinite, with a panorama": '"string filename" "image.pfm" "string mapping" "equirectangular"',
          "spot, with a blend and a radius": '"float blend" 0.5 "float radius" 0.1',
          "point, hidden from the camera": '"string hidden" "camera"',
          "point, in a light group": '"string lightgroup" "key"',
          "infinite, with a portal": '"string filename" "image.pfm" "point3 portal" [0 0 1 1 0 1 1 1 1 0 1 1]'}
# kind of directive: {name: scene}; HEAD stands before WorldBegin, the rest after it.
OPTIONS = {
    "Cameras": ("Camera", ["fisheye", "orthographic", "perspective", "realistic", "spherical"]),
    "Samplers": ("Sampler", ["halton", "independent", "paddedsobol", "sobol", "stratified", "zsobol"]),
    "Filters": ("PixelFilter", ["box", "gaussian", "mitchell", "sinc", "triangle"]),
    "Films": ("Film", ["gbuffer", "rgb", "spectral"]),
    "Integrators": ("Integrator", ["ambientocclusion", "bdpt", "lightpath", "mlt", "path", "randomwalk",
                                   "simplepath", "simplevolpath", "sppm", "volpath"]),
    "Accelerators": ("Accelerator", ["bvh", "kdtree"]),
    "Colour spaces": ("ColorSpace", ["aces2065-1", "dci-p3", "rec2020", "srgb"]),
}
MEDIA = {"cloud": "", "homogeneous": "", "homogeneous, in a light group": '"rgb Le" [1 1 1] "string lightgroup" "fire"', "nanovdb": "", "rgbgrid": '"rgb sigma_s" [1 1 1]',
         "uniformgrid": '"float density" 1', "vdb": ""}
GLTF = {  # extension: what a material, light, node or texture of it looks like
    "KHR_draco_mesh_compression": None, "EXT_meshopt_compression": None, "EXT_mesh_gpu_instancing": None,
    "KHR_lights_punctual": None, "KHR_materials_anisotropy": {}, "KHR_materials_clearcoat": {},
    "KHR_materials_dispersion": {}, "KHR_materials_emissive_strength": {}, "KHR_materials_ior": {},
    "KHR_materials_iridescence": {}, "KHR_materials_pbrSpecularGlossiness": {}, "KHR_materials_sheen": {},
    "KHR_materials_specular": {}, "KHR_materials_transmission": {}, "KHR_materials_unlit": {},
    "KHR_materials_variants": None, "KHR_materials_volume": {}, "KHR_mesh_quantization": None,
    "KHR_texture_basisu": None, "KHR_texture_transform": None, "EXT_texture_webp": None,
    "KHR_animation_pointer": None, "KHR_materials_diffuse_transmission": {}, "KHR_meshopt_compression": None,
    "KHR_node_visibility": None, "KHR_xmp_json_ld": None,
}
GRAPH = '{"texture_graph": 1, "nodes": [{"name": "n", "type": "TEX_NOISE"}], "output": ["n", "Fac"]}'
PLY = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
3 0 1 2
"""


def measured_file():
    """A measured BSDF of the least size."""
    fields = {"phi_i": (1,), "theta_i": (1,), "ndf": (2, 2), "sigma": (2, 2), "vndf": (1, 1, 2, 2),
              "luminance": (1, 1, 2, 2), "wavelengths": (1,), "spectra": (1, 1, 1, 2, 2)}
    at = 18 + sum(13 + len(name) + 8 * len(shape) for name, shape in fields.items())
    head, data = b"tensor_file\0\1\0" + struct.pack("<I", len(fields)), b""
    for name, shape in fields.items():
        head += struct.pack("<H", len(name)) + name.encode() + struct.pack("<HBQ", len(shape), 10, at + len(data))
        head += struct.pack(f"<{len(shape)}Q", *shape)
        data += struct.pack("<f", 1) * (4 if len(shape) > 1 else 1)
    return head + data


def pbrt_scenes():
    """(section, name, text) of everything that pbrt-v4's description of its format lists by name."""
    end = f'WorldBegin\nLightSource "point"\nShape "trianglemesh" {TRIANGLE}\n'
    for section, (directive, names) in OPTIONS.items():
        for name in names:
            parameters = ' "string lensfile" "lens.dat"' if name == "realistic" else ""
            yield section, name, f'{directive} "{name}"{parameters}\n{end}'
    for name, parameters in SHAPES.items():
        yield "Shapes", name, f'WorldBegin\nLightSource "point"\nShape "{name}" {parameters}\n'
    yield ("Shapes", "object instances", f'WorldBegin\nLightSource "point"\nObjectBegin "o"\nShape "sphere"\n'
           'ObjectEnd\nObjectInstance "o"\n')
    yield ("Shapes", "motion blur", 'WorldBegin\nLightSource "point"\nActiveTransform EndTime\nTranslate 1 0 0\n'
           'ActiveTransform All\nShape "sphere"\n')
    for name, parameters in MATERIALS.items():
        parts = 'MakeNamedMaterial "a" "string type" "diffuse"\nMakeNamedMaterial "b" "string type" "diffuse"\n'
        yield ("Materials", name, f'WorldBegin\nLightSource "point"\n{parts}Material "{name}" {parameters}\n'
               'Shape "sphere"\n')
    for kind in ("spectrum", "float"):
        for name, parameters in TEXTURES.items():
            if name in (SPECTRUM_ONLY if kind == "float" else FLOAT_ONLY):
                continue
            use = '"texture reflectance" "t"' if kind == "spectrum" else '"texture displacement" "t"'
            yield (f"Textures ({kind})", name, f'WorldBegin\nLightSource "point"\nTexture "t" "{kind}" "{name}" '
                   f'{parameters}\nMaterial "diffuse" {use}\nShape "sphere"\n')
    for name, parameters in LIGHTS.items():
        yield "Lights", name, f'WorldBegin\nLightSource "{name.split(",")[0]}" {parameters}\nShape "sphere"\n'
    for name, parameters in {"area": "", "area, in a light group": ' "string lightgroup" "key"'}.items():
        yield "Lights", name, f'WorldBegin\nAreaLightSource "diffuse"{parameters}\nShape "sphere"\n'
    for name, parameters in MEDIA.items():
        yield ("Participating media", name, f'WorldBegin\nLightSource "point"\nMakeNamedMedium "m" "string type" '
               f'"{name.split(",")[0]}" {parameters}\nMediumInterface "m" ""\nShape "sphere"\n')


def gltf_scenes():
    for name, material in GLTF.items():
        scene = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
                 "nodes": [{"mesh": 0}], "extensionsUsed": [name], "extensionsRequired": [name],
                 "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,"
                              "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],
                 "bufferViews": [{"buffer": 0, "byteLength": 36}],
                 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                                "min": [0, 0, 0], "max": [1, 1, 0]}],
                 "materials": [{"extensions": {name: material}} if material is not None else {}],
                 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}]}
        yield "Extensions", name, json.dumps(scene)


class Reader:
    def __init__(self, bin_dir, folder):
        self.program, self.folder = pathlib.Path(bin_dir) / "lightmill", folder
        (folder / "mesh.ply").write_text(PLY)
        (folder / "m.bsdf").write_bytes(measured_file())
        (folder / "graph.json").write_text(GRAPH)
        (folder / "lens.dat").write_text("50 5 1.5 20\n-50 0 1 20\n")
        (folder / "image.pfm").write_bytes(b"PF\n2 2\n-1.0\n" + b"\0\0\x80\x3f" * 12)

    def says(self, file, text, ignored=()):
        """"yes", or the reader's own words."""
        path = self.folder / file
        path.write_text(text)
        done = subprocess.run([self.program, "check", path, "--json"], capture_output=True, text=True, timeout=60)
        assert done.returncode in (0, 2), f"{text}\n{done.stderr}"
        problems = [p for p in json.loads(done.stdout)["problems"] if not any(i in p["message"] for i in ignored)]
        worst = [p for p in problems if p["severity"] == "error"] or problems
        if not worst:
            return "yes"
        message = worst[0]["message"].replace(str(self.folder) + "/", "").replace("|", "\\|")
        return ("no: " if worst[0]["severity"] == "error" else "with a warning: ") + message


def table(rows):
    text, section = [], None
    for name, feature, answer in rows:
        if name != section:
            text += ["", f"### {name}", "", "| feature | read? |", "| --- | --- |"]
            section = name
        text.append(f"| {feature} | {answer} |")
    return text


def page(reader):
    lines = ["# What of each scene format is read", "",
             "Made by `tests/docs/scene_formats.py --write`, which gives every feature of the formats' documentation",
             "to the readers as a small scene; the answers are theirs. A test holds that this page is up to date.",
             "*With a warning* means that the scene renders and the warning says what is different; with `--strict`",
             "it is an error.", "", "## pbrt-v4", "",
             "Samplers and accelerators are read and replaced by our own; the integrator is the one that `--integrator`",
             "names, of which `scene` takes the nearest to the file's."]
    lines += table([(s, n, reader.says("scene.pbrt", text)) for s, n, text in pbrt_scenes()])
    lines += ["", "## glTF 2.0", "",
              "All of the core specification; [animations](scenes.md) are shown at a time. Extensions, as asked for by",
              "`extensionsRequired`:"]
    # The probe has neither camera nor light on purpose; what is said of those is no answer.
    probe = ("camera", "light")
    lines += table([(s, n, reader.says("scene.gltf", text, probe)) for s, n, text in gltf_scenes()])
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="lightmill-formats-") as folder:
        text = page(Reader(arguments.bin, pathlib.Path(folder)))
    if arguments.write:
        PAGE.write_text(text)
    elif text != PAGE.read_text():
        new, old = text.splitlines(), PAGE.read_text().splitlines()
        changed = [line for line in new if line not in old]
        sys.exit("docs/scene-formats.md is not what the readers say; run tests/docs/scene_formats.py --write. New:\n" +
                 "\n".join(changed))
    print("ok:", text.count("| yes |"), "features are read,", text.count("| with a warning"), "with a warning,",
          text.count("| no: "), "are not")


if __name__ == "__main__":
    main()
