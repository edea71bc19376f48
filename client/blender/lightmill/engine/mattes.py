"""What Blender's Cryptomatte node asks of a render result: the names behind the ids, by the specification 1.2.0."""
import json

from ..export.mattes import DEFAULT_MATERIAL, asset_of
from ..export.things import materials_of
from .passes import MATTES

WORD = 0xFFFFFFFF
LOWEST_EXPONENT_BIT = 1 << 23


def _rotated(x, bits):
    return (x << bits | x >> 32 - bits) & WORD


def murmur_hash3(data):
    """MurmurHash3_x86_32 (Appleby) of bytes with seed 0."""
    value = 0
    for at in range(0, len(data), 4):
        block = data[at:at + 4]
        mixed = _rotated(int.from_bytes(block, "little") * 0xCC9E2D51 & WORD, 15) * 0x1B873593 & WORD
        value ^= mixed
        if len(block) == 4:
            value = (_rotated(value, 13) * 5 + 0xE6546B64) & WORD
    value ^= len(data)
    value = (value ^ value >> 16) * 0x85EBCA6B & WORD
    value = (value ^ value >> 13) * 0xC2B2AE35 & WORD
    return value ^ value >> 16


def id_of(name):
    """The bits of a name's id, which are those of a float that is no zero, denormal, infinity or NaN."""
    value = murmur_hash3(name.encode("utf-8"))
    return value ^ LOWEST_EXPONENT_BIT if value >> 23 & 255 in (0, 255) else value


def fields_of(depsgraph, view_layer, passes):
    """{field: text} of the mattes among the passes, under the names that Cycles gives."""
    asked = {p.aov for p in passes}
    fields = {}
    for aov, layer in MATTES.values():
        if aov not in asked:
            continue
        name = f"{view_layer.name}.{layer}"
        key = f"cryptomatte/{murmur_hash3(name.encode('utf-8')):08x}"[:len("cryptomatte/") + 7]
        manifest = {n: f"{id_of(n):08x}" for n in sorted(_names(depsgraph, aov))}
        fields |= {f"{key}/name": name, f"{key}/hash": "MurmurHash3_32", f"{key}/conversion": "uint32_to_float32",
                   f"{key}/manifest": json.dumps(manifest, ensure_ascii=False, separators=(",", ":"))}
    return fields


def _names(depsgraph, aov):
    names = set()
    for instance in depsgraph.object_instances:
        thing = instance.object
        if aov == "cryptoobject":
            names.add(thing.name)
        elif aov == "cryptoasset":
            names.add(asset_of(thing).name)
        elif hasattr(thing.data, "materials"):
            names.update(m.name if m else DEFAULT_MATERIAL for m in materials_of(thing) or [None])
    return names
