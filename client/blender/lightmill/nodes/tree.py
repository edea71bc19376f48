"""Walking node trees: what feeds a socket, through groups, reroutes and muted nodes.

All walks are loops, not recursion, and have bounds, so that a tree of any depth ends.
"""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable

MOST_HOPS = 10_000
MOST_GROUPS_DEEP = 32


class Scope:
    """A node tree in its place: the root, or a group as one group node shows it."""

    def __init__(self, tree: Any, owner: str, report: Any, parent: "Scope | None" = None, group: Any = None) -> None:
        self.tree, self.owner, self.report, self.parent, self.group = tree, owner, report, parent, group
        self.depth = 0 if parent is None else parent.depth + 1
        self._children: dict[int, Scope] = {}
        # socket.links would search the whole tree each time.
        self._links = {link.to_socket.as_pointer(): (link.from_node, link.from_socket) for link in tree.links
                       if link.is_valid and not link.is_muted}
        self._sources: dict[int, Source] = {}

    def child(self, node: Any) -> "Scope | None":
        """The tree of a group node; None (reported) if it has none or contains itself."""
        key = node.as_pointer()
        if key not in self._children:
            if node.node_tree is None:
                self.report.add("group", self.owner, node.name, "the node group is missing; its outputs are 0")
                return None
            scope: Scope | None = self
            while scope is not None:
                if scope.tree == node.node_tree or self.depth >= MOST_GROUPS_DEEP:
                    self.report.add("cyclic group", self.owner, node.name, "the node group contains itself or is nested more "
                                    f"than {MOST_GROUPS_DEEP} deep; it is cut here")
                    return None
                scope = scope.parent
            self._children[key] = Scope(node.node_tree, self.owner, self.report, self, node)
        return self._children[key]

    def source(self, socket: Any) -> "Source":
        """What an input socket of a node of this tree gets."""
        key = socket.as_pointer()
        if key not in self._links:
            return Source(None, socket, self, ())
        if key not in self._sources:
            self._sources[key] = _find(self, socket)
        return self._sources[key]


@dataclass(frozen=True)
class Source:
    """What an input gets: an output of `node`, or the value that `socket` has, or nothing (0)."""

    node: Any
    socket: Any  # the output; without a node the unlinked input, or None
    scope: Scope
    through: tuple[str, ...]  # types of the group sockets on the way, from the input backwards

    @property
    def linked(self) -> bool:
        return self.node is not None


def _by_identifier(sockets: Any, identifier: str) -> Any:
    return next((s for s in sockets if s.identifier == identifier), None)


def _find(scope: Scope, socket: Any) -> Source:
    through: list[str] = []
    asked = socket
    for _ in range(MOST_HOPS):
        link = scope._links.get(socket.as_pointer())
        if link is None:
            return Source(None, socket, scope, tuple(through))
        node, output = link
        if node.mute and node.type not in ("GROUP_INPUT",):
            inner = next((i for i in node.internal_links if i.to_socket == output), None)
            if inner is None:
                return Source(None, asked, scope, ())
            socket = inner.from_socket
            through.append(output.type)
            if scope._links.get(socket.as_pointer()) is None:
                return Source(None, None, scope, tuple(through))
        elif node.type == "REROUTE":
            socket = node.inputs[0]
            if scope._links.get(socket.as_pointer()) is None:
                return Source(None, None, scope, tuple(through))
        elif node.type == "GROUP":
            child = scope.child(node)
            end = child and next((n for n in child.tree.nodes if n.type == "GROUP_OUTPUT" and n.is_active_output), None)
            inside = end and _by_identifier(end.inputs, output.identifier)
            if inside is None:
                return Source(None, None, scope, tuple(through))
            through.append(output.type)
            scope, socket = child, inside
        elif node.type == "GROUP_INPUT":
            outside = scope.group and _by_identifier(scope.group.inputs, output.identifier)
            if outside is None:
                return Source(None, None, scope, tuple(through))
            through.append(output.type)
            scope, socket = scope.parent, outside
        else:
            return Source(node, output, scope, tuple(through))
    scope.report.add("links", scope.owner, "", f"an input is more than {MOST_HOPS} links away; it is cut")
    return Source(None, None, scope, ())


def translate_in_order(first: Source, done: dict[Any, Any], key: Callable[[Source], Any],
                       needs: Callable[[Source], list[Source]], translate: Callable[[Source], Any],
                       cut: Callable[[Source], Any]) -> None:
    """Fills `done` for `first` and all that it needs, inputs before what reads them. What reads itself is cut."""
    stack, opened = [first], set()
    while stack:
        source = stack[-1]
        name = key(source)
        if name in done:
            stack.pop()
        elif name in opened:
            done[name] = translate(source)
            stack.pop()
        else:
            opened.add(name)
            for needed in needs(source):
                inner = key(needed)
                if inner in opened and inner not in done:
                    done[inner] = cut(needed)  # it waits for this one: a cycle
                elif inner not in done:
                    stack.append(needed)
