"""Blender in tests: the add-on as it is installed, a small scene, and runs of Blender whose lines are looked at."""
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "farm"))
from farm import GENEROUS_S, Farm, pixels, wait_until  # noqa: E402, F401

if not shutil.which("blender"):
    print("skipped: Blender is not installed (Debian's package blender)")
    sys.exit(77)

ADDON = ROOT / "client" / "blender" / "lightmill"
# Blender's first scene, small: a cube in the middle, a lamp, a camera.
SMALL = """
import bpy
s = bpy.context.scene
s.render.resolution_x, s.render.resolution_y = 96, 64
s.render.image_settings.file_format, s.render.image_settings.color_depth = "OPEN_EXR", "32"
s.lightmill.samples, s.lightmill.integrator = 16, "pt"
"""


class Blender:
    """A folder with the add-on, where pictures go."""

    def __init__(self, bin_dir, *, addon=ADDON):
        self.bin = pathlib.Path(bin_dir).resolve()
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="lightmill-blender-"))
        addons = self.folder / "scripts" / "addons"
        addons.mkdir(parents=True)
        if addon:
            (addons / "lightmill").symlink_to(addon)
        self.environment = {"BLENDER_USER_SCRIPTS": str(self.folder / "scripts"),
                            "BLENDER_USER_CONFIG": str(self.folder / "config"),
                            "TMPDIR": str(self.folder / "tmp"),
                            "LIGHTMILL_PROGRAM": str(self.bin / "lightmill")}
        (self.folder / "tmp").mkdir()
        self.processes = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for process in self.processes:
            if process.poll() is None:
                process.kill()
                process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)

    def start(self, *arguments, script="", background=True, environment=None):
        """As a user starts it, but with the first scene, made small, and what `script` changes."""
        return self._start([*(["-b"] if background else []), "--factory-startup", "--python-exit-code", "1",
                            "--addons", "lightmill", "--python-expr", SMALL + script, "-E", "LIGHTMILL",
                            "-o", f"{self.folder}/frame####", *map(str, arguments)], environment or {})

    def _start(self, arguments, environment):
        log = self.folder / f"log{len(self.processes)}"
        with open(log, "wb") as out:
            process = subprocess.Popen(["blender", *arguments], stdin=subprocess.DEVNULL, stdout=out, stderr=out,
                                       env={**os.environ, **self.environment, **environment})
        process.log = log
        self.processes.append(process)
        return process

    def run(self, *arguments, expect=0, **options):
        """Runs Blender to its end and returns what it said."""
        return self._end(self.start(*arguments, **options), expect)

    def run_plain(self, script):
        """A script in a Blender without the add-on."""
        return self._end(self._start(["-b", "--factory-startup", "--python-exit-code", "1", "--python-expr",
                                      "import bpy\n" + script], {}), 0)

    def _end(self, process, expect):
        try:
            code = process.wait(GENEROUS_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            code = "never"
        text = said(process)
        assert code == expect, f"Blender's exit code is {code}, want {expect}:\n{text[-3000:]}"
        return text

    def picture(self, number=1):
        return self.folder / f"frame{number:04}.exr"

    def farm_processes(self):
        """(number, command line) of the farm's processes that this folder's Blender started."""
        found = []
        for process in pathlib.Path("/proc").glob("[0-9]*"):
            try:
                line = (process / "cmdline").read_bytes().replace(b"\0", b" ").decode("utf-8", "replace")
                ours = f"TMPDIR={self.folder}/tmp".encode() in (process / "environ").read_bytes()
            except OSError:
                continue
            if ours and ("lightmill-" in line.split(" ", 1)[0] or "guardian.py" in line):
                found.append((int(process.name), line))
        return found

    def assert_nothing_left(self):
        """The processes of this machine's farm end with Blender, and their data goes with them."""
        wait_until("the end of the local farm", lambda: not self.farm_processes())
        assert not list((self.folder / "tmp").glob("lightmill-farm-*")), list((self.folder / "tmp").iterdir())


def said(process):
    return process.log.read_text("utf-8", "replace")


def error_lines(text):
    return [line for line in text.splitlines() if line.startswith("lightmill: ") and "warning" not in line]


def interrupt(process):
    process.send_signal(signal.SIGINT)
    return process.wait(GENEROUS_S)
