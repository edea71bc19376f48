"""Where things of the project lie, for tests of the farm."""
import pathlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROOM = ROOT / "tests" / "farm" / "room.pbrt"  # what a process has loaded soon: its first lines say why
