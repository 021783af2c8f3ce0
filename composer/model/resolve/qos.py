"""QoS profiles: named, presets, inline and extended ones."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Mapping as Map
from dataclasses import field
from functools import partial
from typing import Any

from composer.base.fast_dataclass import dataclass, replace
from composer.base.source import Located, Span
from composer.language.tree import (
    Entry,
    Mapping,
    Scalar,
    Tree,
    choice,
    entries,
    integer,
    is_opaque,
    key,
    number,
    text,
)
from composer.model import ChannelKind, NamedQos, Qos, QosReference
from composer.model.qos import DURATIONS, PRESETS, WORDS, QosProfile

PolicyReader = Callable[[Tree], "Located[Any] | None"]


@dataclass(slots=True)
class QosTable:
    """The named profiles of a system, and all references to names."""

    named: tuple[NamedQos, ...] = ()
    by_name: dict[str, Qos] = field(default_factory=dict)
    references: list[QosReference] = field(default_factory=list)

    def resolve(self, tree: Tree | None, default: Qos) -> Qos:
        """Return the profile that ``tree`` names or declares inline; ``default`` without one.

        An unknown name gives the values of ``default``; the rules find it in the references.
        """
        if isinstance(tree, Mapping):
            base = self._base(tree, default)
            inline = frozenset(entry.name for entry in entries(tree))
            return replace(_overlaid(tree, base, tree.span), inline=inline)
        name = text(tree)
        if name is None:
            return default if tree is None else _as_unknown(default)
        found = self.use(name)
        return replace(found or _as_unknown(default), span=name.span, explicit=True)

    def use(self, name: Located[str]) -> Qos | None:
        """Return the profile ``name``, and record the reference."""
        if is_opaque(name.value):
            return None
        self.references.append(QosReference(name))
        return self.by_name.get(name.value) or _preset(name)

    def _base(self, tree: Mapping, default: Qos) -> Qos:
        extends = text(tree.get("extends"))
        if extends is None:
            # Policies that an inline profile does not set are rclpy's defaults for any port.
            return replace(default, profile=QosProfile())
        return self.use(extends) or _as_unknown(default)


def qos_table(tree: Tree | None) -> QosTable:
    """Resolve ``qos_profiles``, each over the profile that it extends.

    A profile in a cycle, or one that extends an unknown name, is based on rclpy's default.
    """
    table = QosTable()
    written = {entry.name: entry for entry in entries(tree) if isinstance(entry.value, Mapping)}
    for entry in written.values():
        for link in reversed(_unresolved_chain(entry, written, table.by_name)):
            table.by_name[link.name] = _profile(link, table.by_name)
    table.named = tuple(
        NamedQos(key(entry), table.by_name[entry.name], _extends(entry))
        for entry in written.values()
    )
    for profile in table.named:
        if profile.extends is not None:
            table.references.append(QosReference(profile.extends))
    return table


def implicit_qos(kind: ChannelKind, span: Span) -> Qos:
    """Return the profile of a port without ``qos``: rclpy's default for its kind."""
    preset = "command" if kind is ChannelKind.TOPIC else "services_default"
    return Qos(PRESETS[preset], span, explicit=False)


def _unresolved_chain(
    entry: Entry, written: Map[str, Entry], resolved: Map[str, Qos]
) -> list[Entry]:
    """Return ``entry`` and the profiles it extends, up to a resolved one. Not recursive."""
    chain: dict[str, Entry] = {}
    link: Entry | None = entry
    while link is not None and link.name not in chain and link.name not in resolved:
        chain[link.name] = link
        extends = _extends(link)
        link = written.get(extends.value) if extends is not None else None
    return list(chain.values())


def _profile(entry: Entry, resolved: Map[str, Qos]) -> Qos:
    extends = _extends(entry)
    base = Qos(QosProfile(), entry.key.span)
    if extends is not None:
        base = resolved.get(extends.value) or _preset(extends) or _as_unknown(base)
    return _overlaid(entry.value, base, entry.key.span)


def _extends(entry: Entry) -> Located[str] | None:
    return text(entry.value.get("extends")) if isinstance(entry.value, Mapping) else None


def _preset(name: Located[str]) -> Qos | None:
    profile = PRESETS.get(name.value)
    return Qos(profile, name.span) if profile is not None else None


def _as_unknown(qos: Qos) -> Qos:
    """Return the profile marked as a placeholder for an unknown one."""
    return replace(qos, known=False)


def _overlaid(tree: Tree, base: Qos, span: Span) -> Qos:
    """Return ``base`` with the policies of ``tree``."""
    changes: dict[str, Any] = {}
    spans = dict(base.policy_spans)
    known = base.known
    for entry in entries(tree):
        read = _POLICIES.get(entry.name)
        value = read(entry.value) if read is not None else None
        if value is not None:
            changes[entry.name] = value.value
            spans[entry.name] = entry.value.span
        elif entry.name != "extends":
            known = False
    profile = replace(base.profile, **changes)
    return Qos(profile, span, explicit=True, policy_spans=tuple(spans.items()), known=known)


def _duration(tree: Tree) -> Located[Any] | None:
    if isinstance(tree, Scalar) and tree.value is None:
        return Located(None, tree.span)
    return number(tree)


_POLICIES: Map[str, PolicyReader] = {
    "depth": integer,
    **{name: partial(choice, kind=kind) for name, kind in WORDS.items()},
    **dict.fromkeys(DURATIONS, _duration),
}
