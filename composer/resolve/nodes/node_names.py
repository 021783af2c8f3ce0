"""The names of a node of a system: its key, its name and namespace in ROS, and inner nodes."""

from __future__ import annotations

from composer.fast_dataclass import dataclass
from composer.model import Executable
from composer.names import join
from composer.resolve.tree_values import is_opaque, text_or_opaque
from composer.source import Located
from composer.tree import Entry, Mapping, Tree


@dataclass(frozen=True, slots=True)
class NodeNames:
    """The key of a node in its system, its name in ROS if that differs, and its namespace.

    ``inner`` are the full names of further nodes of its program. ``are_kept`` is true if the
    program keeps the names of its nodes.
    """

    key: str
    namespace: Located[str]  # absolute
    own_name: Located[str] | None = None
    inner: tuple[str, ...] = ()
    are_kept: bool = False

    @property
    def ros_name(self) -> str:
        """The name in ROS, without the namespace."""
        return self.key if self.own_name is None else self.own_name.value

    @property
    def full_name(self) -> str:
        """The full name in ROS."""
        return join(self.namespace.value, self.ros_name)


def node_names(
    entry: Entry, tree: Mapping, program: Executable | None, system_namespace: Located[str]
) -> NodeNames:
    """Return the names of the node of an entry in ``nodes``."""
    namespace = _namespace(tree.get("namespace"), system_namespace)
    written = tree.get("name")
    own_name = None if written is None else text_or_opaque(written, written.span)
    listed = None if program is None else program.nodes
    are_kept = listed is not None and own_name is None
    if listed and own_name is None:
        own_name = listed[0]
    names = NodeNames(entry.name, namespace, own_name)
    inner = (join(namespace.value, item.value) for item in listed or ())
    others = tuple(name for name in inner if name != names.full_name)
    return NodeNames(entry.name, namespace, own_name, others, are_kept)


def _namespace(tree: Tree | None, system: Located[str]) -> Located[str]:
    """Return the absolute namespace of a node; a relative one is below the system's."""
    if tree is None:
        return system
    own = text_or_opaque(tree, tree.span)
    return own if is_opaque(own.value) else own.map(lambda name: join(system.value, name))
