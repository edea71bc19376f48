"""What could not be written as Blender has it."""
from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

MOST_MESSAGES = 1000


@dataclass(frozen=True)
class Message:
    """One thing that is drawn in another way than by Cycles."""

    kind: str  # what it is about, e.g. "node"
    owner: str  # the material, world, lamp or object
    node: str  # the node's name, or ""
    text: str  # what is drawn instead

    def __str__(self) -> str:
        where = f"{self.owner}, node {self.node}" if self.node else self.owner
        return f"{where}: {self.text}"


class Report:
    """Messages, one a kind and owner."""

    def __init__(self) -> None:
        self.messages: list[Message] = []
        self._seen: set[tuple[str, str]] = set()
        self._paused = False

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Drops messages, but lasting ones: for a try whose result may not be used."""
        before, self._paused = self._paused, True
        try:
            yield
        finally:
            self._paused = before

    def add(self, kind: str, owner: str, node: str, text: str, lasting: bool = False) -> None:
        """`lasting`: it holds in whatever way the thing is drawn in the end, as of a file that is not there."""
        if (self._paused and not lasting) or (kind, owner) in self._seen or len(self.messages) >= MOST_MESSAGES:
            return
        self._seen.add((kind, owner))
        self.messages.append(Message(kind, owner, node, text))
