"""Place an included system below a namespace, and prefix the names of its nodes.

Settings of the file for all of its nodes (namespace, lifecycle, introspection, use_sim_time) move
into each node, so that they do not affect the including system.
"""

from __future__ import annotations

import os
from pathlib import Path

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, Span
from composer.language.tree import Entry, Mapping, Scalar, Sequence, Tree
from composer.language.tree_values import changed_at, entries, is_opaque
from composer.model import USE_SIM_TIME
from composer.model.assembly.merging import merge_maps
from composer.model.assembly.references import add_prefix, with_prefix

#: Keys that a file has for all nodes, and a node for itself.
_NODE_DEFAULTS = ("lifecycle", "introspection")
#: Sections whose entries get the prefix.
PREFIXED = ("nodes", "chains")
#: Keys of ``lifecycle`` that apply to the whole system, not to each node.
_NOT_INHERITED = frozenset({"implied_dependencies"})


@dataclass(frozen=True, slots=True)
class Placement:
    """The prefix for node names and the namespace that an include gives to a file."""

    prefix: str = ""
    namespace: Located[str] | None = None


def add_namespace(tree: Mapping, placement: Placement, includer: Path, folder: Path) -> Mapping:
    """Return a system from ``folder`` as a part of the system in the folder ``includer``."""
    namespace = _join_namespaces(placement.namespace, tree.get("namespace"))
    defaults = _defaults(tree)
    prefix = placement.prefix

    def prefixed(section: Tree) -> Tree:
        named = (Entry(with_prefix(item.key, prefix), item.value) for item in entries(section))
        return Mapping(tuple(named), section.span) if isinstance(section, Mapping) else section

    def placed(nodes: Tree) -> Tree:
        made = (_placed(entry, namespace, defaults) for entry in entries(nodes))
        return Mapping(tuple(made), nodes.span) if isinstance(nodes, Mapping) else nodes

    tree = add_prefix(tree, prefix) if prefix else tree
    for section in PREFIXED:
        tree = changed_at(tree, (section,), prefixed)
    tree = changed_at(tree, ("nodes",), placed)
    if namespace is not None:
        for kind in ("topic", "service", "action"):
            path = ("connections", "*", kind)
            tree = changed_at(tree, path, lambda name: _below(namespace, name))
    return changed_at(
        tree, ("parameter_files",), lambda files: _relative_to(includer, folder, files)
    )


def _join_namespaces(outer: Located[str] | None, inner: Tree | None) -> Located[str] | None:
    """Return the namespace ``inner`` below ``outer``; an absolute one is not changed."""
    if not isinstance(inner, Scalar) or not isinstance(inner.value, str):
        return outer
    if outer is None or inner.value.startswith("/") or is_opaque(inner.value):
        return Located(inner.value, inner.span)
    return Located(f"{outer.value.rstrip('/')}/{inner.value}", inner.span)


def _below(namespace: Located[str], name: Tree) -> Tree:
    """Return the relative name of a connection below ``namespace``."""
    match name:
        case Scalar(value=str() as text) if text and text[0] not in "/~" and not is_opaque(text):
            return Scalar(f"{namespace.value.rstrip('/')}/{text}", name.span, verbatim=False)
        case _:
            return name


def _relative_to(includer: Path, folder: Path, tree: Tree) -> Tree:
    """Return paths relative to ``folder`` as paths relative to ``includer``."""
    match tree:
        case Sequence():
            items = tuple(_relative_to(includer, folder, item) for item in tree.items)
            return Sequence(items, tree.span)
        case Scalar(value=str() as text) if includer != folder and not is_opaque(text):
            path = os.path.relpath(folder / text, includer)
            return Scalar(path, tree.span, verbatim=False)
        case _:
            return tree


def _defaults(tree: Mapping) -> dict[str, Mapping]:
    """Return the settings of a file for all of its nodes, by their key in a node."""
    found = {}
    for name in _NODE_DEFAULTS:
        section = tree.get(name)
        given = tuple(entry for entry in entries(section) if entry.name not in _NOT_INHERITED)
        if section is not None and given:
            found[name] = Mapping(given, section.span)
    clock = tree.entry(USE_SIM_TIME)
    if clock is not None and isinstance(clock.value, Scalar):
        found["parameters"] = Mapping((clock,), clock.key.span)
    return found


def _placed(node: Entry, namespace: Located[str] | None, defaults: dict[str, Mapping]) -> Entry:
    """Return a node with the defaults of its file, below ``namespace``."""
    tree, span = node.value, node.key.span
    if not isinstance(tree, Mapping):
        return node
    added = [_with_defaults(tree.entry(name), name, defaults[name], span) for name in defaults]
    added.append(_namespace_entry(tree.entry("namespace"), namespace, span))
    changes = {change.name: change for change in added if change is not None}
    kept = tuple(changes.pop(inner.name, inner) for inner in tree)
    return Entry(node.key, Mapping((*kept, *changes.values()), tree.span))


def _namespace_entry(own: Entry | None, namespace: Located[str] | None, span: Span) -> Entry | None:
    if namespace is None or (own is not None and not isinstance(own.value, Scalar)):
        return None
    below = _join_namespaces(namespace, None if own is None else own.value) or namespace
    key = Scalar("namespace", span, verbatim=False) if own is None else own.key
    return Entry(key, Scalar(below.value, below.span, verbatim=False))


def _with_defaults(own: Entry | None, name: str, defaults: Mapping, span: Span) -> Entry | None:
    """Return the node's entry ``name`` merged over the defaults of its file."""
    if own is None:
        return Entry(Scalar(name, span, verbatim=False), defaults)
    if not isinstance(own.value, Mapping):
        return None
    return Entry(own.key, merge_maps(defaults, own.value))
