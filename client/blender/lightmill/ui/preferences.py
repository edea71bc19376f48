"""What belongs to this machine and its user, not to a .blend file: the program, the farm, and what opens its door."""
import bpy
from bpy.props import IntProperty, StringProperty

PACKAGE = __package__.rpartition(".")[0]


class LightmillPreferences(bpy.types.AddonPreferences):
    bl_idname = PACKAGE
    program: StringProperty(
        name="Program", subtype="FILE_PATH", description="The program lightmill of this machine, with lightmill-coordinator "
        "and lightmill-worker beside it; empty: $LIGHTMILL_PROGRAM, then the path. A farm needs none")
    coordinator: StringProperty(
        name="Coordinator", description="http(s)://HOST:PORT of the farm, for scenes that name none; empty: this machine")
    credentials: StringProperty(
        name="Credentials", subtype="DIR_PATH", description="Folder that `lightmill-coordinator grant` made: ca.crt and token")
    ca: StringProperty(name="Authority", subtype="FILE_PATH", description="Certificate of the farm's authority, PEM")
    token_file: StringProperty(name="Token", subtype="FILE_PATH", description="File with the token")
    cert: StringProperty(name="Certificate", subtype="FILE_PATH", description="Our own, for a proxy that asks for it; PEM")
    key: StringProperty(name="Key", subtype="FILE_PATH", description="Of our certificate; PEM")
    reconnect_seconds: IntProperty(
        name="Wait for a Lost Farm", description="Seconds after which a render fails if its coordinator stays away",
        default=60, min=1, max=86400)

    def draw(self, _context):
        layout = self.layout
        layout.use_property_split = True
        layout.label(text="This machine")
        layout.prop(self, "program")
        layout.label(text="Farm")
        for name in ("coordinator", "reconnect_seconds", "credentials", "ca", "token_file", "cert", "key"):
            layout.prop(self, name)


CLASSES = (LightmillPreferences,)
