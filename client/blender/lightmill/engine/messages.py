"""What the user is told: in Blender's report, and in a line on stderr."""
import re
import sys


def tell(engine, kind, text):
    """`kind`: INFO, WARNING or ERROR. After an error Blender saves no picture, and in background mode ends with 1."""
    engine.report({kind}, text)
    print(f"lightmill: {text}" if kind != "WARNING" else f"lightmill: warning: {text}", file=sys.stderr, flush=True)


def with_owners(text, owners):
    """A message of the farm's about files of meshes, which nobody knows, with the names of objects instead."""
    return re.sub(r'"(meshes/\w+\.ply)"', lambda found: f'"{owners.get(found[1], found[1])}"', text)


class Once:
    """Warnings that were said before are not said again for the next frame."""

    def __init__(self):
        self._said = set()

    def warn(self, engine, text):
        if text not in self._said:
            self._said.add(text)
            tell(engine, "WARNING", text)
