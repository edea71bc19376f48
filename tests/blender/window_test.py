"""Blender's window, under Xvfb: F12 shows a picture that grows, Esc cancels, and the viewport shows the scene as it changes.

    window_test.py --bin build/release/bin

Keys are X events, as from a keyboard. Blender's own script, below, looks at pixels and says what it sees.
"""
import argparse
import ctypes
import ctypes.util
import os
import shutil
import subprocess
import sys

from blender_runs import Blender, said, wait_until

if not shutil.which("Xvfb"):
    print("skipped: there is no Xvfb (Debian's package xvfb)")
    sys.exit(77)
if not ctypes.util.find_library("Xtst"):
    print("skipped: there is no libXtst (Debian's package libxtst6)")
    sys.exit(77)

WATCH = """
import time, traceback
bpy.context.preferences.view.render_display_type = "AREA"
bpy.context.preferences.view.show_splash = False
s.lightmill.samples = 1 << 20
s.lightmill.preview_samples = 16

def say(text):
    print("saw:", text, flush=True)

def view():
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in ("VIEW_3D", "IMAGE_EDITOR"):  # the render's picture took its place
                area.type = "VIEW_3D"
                return area

def look(area):
    \"\"\"The colour that the window shows in the middle of the viewport.\"\"\"
    path = bpy.app.tempdir + "window.png"
    bpy.ops.screen.screenshot(filepath=path)
    image = bpy.data.images.load(path)
    x, y = area.x + area.width // 2, area.y + area.height // 2
    start = 4 * (y * image.size[0] + x)
    colour = [round(v, 3) for v in image.pixels[start:start + 3]]
    bpy.data.images.remove(image)
    return colour

stats = []
from lightmill.engine import render_engine
text_of = render_engine.text_of
render_engine.text_of = lambda rendering: stats.append(text_of(rendering)) or stats[-1]  # the status line
def plan():
    say("window ready")
    while not bpy.app.is_job_running("RENDER"):
        yield
    say("rendering")
    while not any(" samples" in text for text in stats):
        yield
    say("samples")
    path = bpy.app.tempdir + "growing.png"
    s.render.image_settings.file_format = "PNG"
    while True:
        try:
            bpy.data.images["Render Result"].save_render(path)
            break
        except RuntimeError:  # it is being written
            yield
    image = bpy.data.images.load(path)
    middle = image.pixels[4 * (32 * 96 + 48):][:3]
    say(f"picture {sum(middle) > 0.1}")
    say("press escape")
    while bpy.app.is_job_running("RENDER"):
        yield
    say("cancelled")
    area = view()
    yield
    began = time.monotonic()
    area.spaces.active.overlay.show_overlays = False
    area.spaces.active.shading.type = "RENDERED"
    from lightmill.engine import viewport
    while not any(x._texture for x in viewport._sessions):
        yield
    say(f"viewport after {time.monotonic() - began:.2f} s")
    for _ in range(20):
        yield
    before = look(area)
    say(f"middle {before}")
    bpy.data.materials["Material"].node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (1, 0, 0, 1)
    bpy.data.objects["Cube"].scale = (3, 3, 3)
    session, = viewport._sessions
    shown = session._number
    while session._number == shown or not session._shown:
        yield
    for _ in range(20):
        yield
    after = look(area)
    say(f"changed {after != before} {after}")
    material = bpy.data.materials["Material"]
    material.asset_mark()
    material.asset_generate_preview()
    while not any(material.preview.image_pixels_float[:]):
        yield
    say("material preview")
    say("end")
    while True:
        yield

steps = plan()

def tick():
    try:
        next(steps)
    except Exception:
        traceback.print_exc()
        say("error")
        return None
    return 0.05

bpy.app.timers.register(tick, first_interval=1.0)
"""


class Display:
    """An X server without a screen, and its keyboard."""

    def __enter__(self):
        read, write = os.pipe()
        self.process = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x800x24", "-nolisten", "tcp"],
                                        pass_fds=[write], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as said_by_server:
            self.name = f":{said_by_server.readline().strip()}"
        self.x11 = ctypes.CDLL(ctypes.util.find_library("X11"))
        self.xtst = ctypes.CDLL(ctypes.util.find_library("Xtst"))
        self.x11.XOpenDisplay.restype = ctypes.c_void_p
        self.display = ctypes.c_void_p(self.x11.XOpenDisplay(self.name.encode()))
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()

    def press(self, symbol):
        """A key by the number of its X keysym, with the pointer over the window's middle."""
        self.xtst.XTestFakeMotionEvent(self.display, -1, 500, 400, 0)
        code = self.x11.XKeysymToKeycode(self.display, ctypes.c_ulong(symbol))
        for down in (1, 0):
            self.xtst.XTestFakeKeyEvent(self.display, code, down, 0)
        self.x11.XFlush(self.display)


F12, ESCAPE = 0xFFC9, 0xFF1B


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    arguments = parser.parse_args()
    with Display() as display, Blender(arguments.bin) as blender:
        process = blender.start("--window-geometry", 0, 0, 1280, 800, script=WATCH, background=False,
                                environment={"DISPLAY": display.name, "LIBGL_ALWAYS_SOFTWARE": "1"})

        def sees(text):
            wait_until(text, lambda: f"saw: {text}" in said(process) or process.poll() is not None or
                       "saw: error" in said(process))
            assert f"saw: {text}" in said(process), said(process)

        sees("window ready")
        display.press(F12)
        sees("picture True")
        sees("press escape")
        display.press(ESCAPE)
        sees("cancelled")
        sees("changed True")
        sees("material preview")
        sees("end")
        print("\n".join(line for line in said(process).splitlines() if line.startswith("saw:")))
        process.terminate()
        process.wait()
        blender.assert_nothing_left()
        print("ok")


if __name__ == "__main__":
    main()
