"""Render passes: what Lightmill records of each pixel (common/job/aovs.h), under Blender's names of passes."""
import dataclasses

import numpy

from ..light_groups import name_of

FAR = 1e10  # Blender's depth where nothing is hit
MOST_LIGHT_GROUPS = 31


@dataclasses.dataclass(frozen=True)
class Pass:
    """`aov`: its name in a job. `channels`: a letter each, as Blender has them. `layer`: in pictures, if not the AOV's name."""
    name: str
    aov: str
    channels: str
    kind: str  # COLOR, VECTOR or VALUE: the socket of the compositor
    layer: str = ""


def _lobe(name, layer):
    return Pass(name, "lobes", "RGB", "COLOR", layer)


# By the property of the view layer that asks for them, or of its `lightmill`.
OF_VIEW_LAYER = {
    "use_pass_z": (Pass("Depth", "depth", "Z", "VALUE"),),
    "use_pass_position": (Pass("Position", "position", "XYZ", "VECTOR"),),
    "use_pass_normal": (Pass("Normal", "normal", "XYZ", "VECTOR"),),
    "use_pass_vector": (Pass("Vector", "motion", "XYZW", "VECTOR"),),
    "use_pass_uv": (Pass("UV", "uv", "UVA", "VECTOR"),),
    "use_pass_object_index": (Pass("IndexOB", "objectid", "X", "VALUE"),),
    "use_pass_material_index": (Pass("IndexMA", "materialid", "X", "VALUE"),),
    # What the surface's lobes reflect and transmit of white light.
    "use_pass_diffuse_color": (Pass("DiffCol", "diffusealbedo", "RGB", "COLOR"),),
    "use_pass_glossy_color": (Pass("GlossCol", "specularalbedo", "RGB", "COLOR"),),
    # Light itself: Cycles divides these by colours of the surface, which make it Combined again. Here their sum is.
    "use_pass_diffuse_direct": (_lobe("DiffDir", "diffuse_direct"),),
    "use_pass_diffuse_indirect": (_lobe("DiffInd", "diffuse_indirect"),),
    "use_pass_glossy_direct": (_lobe("GlossDir", "glossy_direct"),),
    "use_pass_glossy_indirect": (_lobe("GlossInd", "glossy_indirect"),),
    "use_pass_transmission_direct": (_lobe("TransDir", "transmission_direct"),),
    "use_pass_transmission_indirect": (_lobe("TransInd", "transmission_indirect"),),
    "use_pass_emit": (_lobe("Emit", "emission"),),  # with the background
}
OF_LIGHTMILL = {
    "use_pass_denoising": (Pass("Denoising Normal", "normal", "XYZ", "VECTOR"),
                           Pass("Denoising Albedo", "albedo", "RGB", "COLOR"),
                           Pass("Denoising Depth", "depth", "Z", "VALUE")),
    "use_pass_alpha": (Pass("Alpha", "alpha", "A", "VALUE"),),
    "use_pass_direct": (Pass("Direct", "direct", "RGB", "COLOR"),),
    "use_pass_indirect": (Pass("Indirect", "indirect", "RGB", "COLOR"),),
    "use_pass_volume_direct": (_lobe("VolumeDir", "volume_direct"),),  # properties of Cycles' own in Blender
    "use_pass_volume_indirect": (_lobe("VolumeInd", "volume_indirect"),),
    "use_pass_variance": (Pass("Variance", "variance", "RGB", "COLOR"),),
    "use_pass_sample_count": (Pass("Debug Sample Count", "samples", "X", "VALUE"),),
}
# Cryptomatte: by the view layer's property, the AOV and what Blender calls its passes before their number.
MATTES = {
    "use_pass_cryptomatte_object": ("cryptoobject", "CryptoObject"),
    "use_pass_cryptomatte_material": ("cryptomaterial", "CryptoMaterial"),
    "use_pass_cryptomatte_asset": ("cryptoasset", "CryptoAsset"),
}
MOST_MATTE_PASSES = 3  # of two ids each
# Passes of Blender that Lightmill has nothing for.
UNSUPPORTED = {
    "use_pass_mist": "Mist", "use_pass_shadow": "Shadow", "use_pass_ambient_occlusion": "Ambient Occlusion",
    "use_pass_environment": "Environment",
    "use_pass_transmission_color": "Transmission Color", "use_pass_subsurface_direct": "Subsurface Direct",
    "use_pass_subsurface_indirect": "Subsurface Indirect", "use_pass_subsurface_color": "Subsurface Color",
}


def passes_of(view_layer):
    """The passes beside Combined that it asks for."""
    wanted = [p for name, passes in OF_VIEW_LAYER.items() if getattr(view_layer, name, False) for p in passes]
    settings = getattr(view_layer, "lightmill", None)
    wanted += [p for name, passes in OF_LIGHTMILL.items() if getattr(settings, name, False) for p in passes]
    wanted += _mattes(view_layer)
    return wanted + [Pass(f"Combined_{name}", "lightgroups", "RGB", "COLOR", f"lightgroup_{name_of(name)}")
                     for name in _light_groups(view_layer)]


def _mattes(view_layer):
    count = min(MOST_MATTE_PASSES, (getattr(view_layer, "pass_cryptomatte_depth", 2 * MOST_MATTE_PASSES) + 1) // 2)
    return [Pass(f"{name}{number:02}", aov, "rgba", "COLOR", f"{name}{number:02}")
            for flag, (aov, name) in MATTES.items() if getattr(view_layer, flag, False) for number in range(count)]


def _light_groups(view_layer):
    return [group.name for group in getattr(view_layer, "lightgroups", ())]


def light_group_notes(view_layer):
    """What can't be shown of its light groups, a line each."""
    names, first, notes = _light_groups(view_layer), {}, []
    if len(names) > MOST_LIGHT_GROUPS:
        notes.append(f"has {len(names)} light groups; {MOST_LIGHT_GROUPS} are recorded at most")
    for name in names:
        other = first.setdefault(name_of(name), name)
        if other != name:
            notes.append(f"the light groups {other!r} and {name!r} are both written {name_of(name)!r} and shown as one: rename one")
    return notes


def unsupported_of(view_layer):
    """Names of the passes that it asks for and that are not made."""
    return [name for flag, name in UNSUPPORTED.items() if getattr(view_layer, flag, False)]


def motion_notes(scene, view_layer):
    """What can't be shown of motion, a line each."""
    if not getattr(view_layer, "use_pass_vector", False) or scene.render.use_motion_blur:
        return []
    return ["the pass Vector is 0: it shows what moves while the shutter is open, and Motion Blur is off"]


def aovs_of(passes, transparent):
    """The option `aovs` of a job, or None."""
    names = {p.aov for p in passes}
    names = sorted(names | ({"alpha"} if transparent or "uv" in names else set()))
    return ",".join(names) or None


def channels_of(picture):
    """An api.Picture -> AOV name -> float32 rows x columns x channels, from below as Blender wants it; "rgb" is the colour."""
    values = picture.array()[::-1]
    groups = {"rgb": [0, 1, 2]}
    for i, name in enumerate(picture.channels[3:], 3):
        groups.setdefault("alpha" if name == "A" else name.rsplit(".", 1)[0], []).append(i)
    return {name: values[:, :, channels] for name, channels in groups.items()}


def combined(channels, transparent):
    """Blender's Combined: RGBA with colours multiplied by alpha, which is 1 if the film is not transparent or the picture
    has none yet."""
    rgb = channels["rgb"]
    alpha = channels.get("alpha") if transparent else None
    if alpha is None:
        alpha = numpy.ones((*rgb.shape[:2], 1), "f4")
    return numpy.concatenate([rgb, alpha], axis=2)


def pixels_of(wanted, channels):
    """The pixels of a pass; None if the picture has none yet."""
    values = channels.get(wanted.layer or wanted.aov)
    if values is None:
        return None
    if wanted.aov == "depth":
        values = numpy.where(values > 0, values, numpy.float32(FAR))
    elif wanted.aov == "uv":  # the last channel says where there is something
        values = numpy.concatenate([values, (channels["alpha"] > 0).astype("f4")], axis=2)
    elif wanted.aov == "motion":
        # Where it was less where it is, and where it is less where it will be: before and after the exposure's middle.
        half = values * numpy.float32(-0.5)
        values = numpy.concatenate([half, half], axis=2)
    return values
