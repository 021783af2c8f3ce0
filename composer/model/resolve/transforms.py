"""Read the frames of a node."""

from __future__ import annotations

import math
from collections.abc import Iterator

from composer.base.source import Located
from composer.language.tree import (
    Entry,
    Mapping,
    Sequence,
    Tree,
    entries,
    flag,
    key,
    mapping,
    number,
    text,
    text_or_opaque,
    texts,
)
from composer.model import DynamicTransform, StaticTransform, Transforms, transform_ports
from composer.model.transforms import IDENTITY, Quaternion, Transform, Vector, quaternion_of_angles

_ANGLES = ("roll", "pitch", "yaw")
_ROTATIONS = ("rotation_rad", "rotation_deg", "quaternion")


def read_transforms(entry: Entry | None) -> Transforms | None:
    """Return the frames of a node type or an inline node; their ports have no full names yet."""
    if entry is None or not isinstance(entry.value, Mapping):
        return None
    tree, span = entry.value, entry.key.span
    static = tuple(_static(item) for item in entries(tree.get("static")))
    dynamic = tuple(_dynamic(item) for item in entries(tree.get("dynamic")))
    listed = tree.get("lookup")
    lookup = Located(texts(listed), listed.span) if isinstance(listed, Sequence) else None
    ports = transform_ports(
        span, has_static=bool(static), has_dynamic=bool(dynamic), looks_up=lookup is not None
    )
    return Transforms(span, static, dynamic, lookup, tuple(ports))


def merged_transforms(declared: Entry | None, given: Entry) -> Entry:
    """Return the frames of a node type; frames of the instance replace them one by one."""
    if declared is None or not isinstance(given.value, Mapping):
        return given
    kept = {item.name: item for item in entries(declared.value)}
    for section in given.value:
        known = kept.get(section.name)
        if known is None or not isinstance(section.value, Mapping):
            kept[section.name] = section
            continue
        frames = {item.name: item for item in entries(known.value)}
        frames |= {item.name: item for item in section.value}
        kept[section.name] = Entry(section.key, Mapping(tuple(frames.values()), section.value.span))
    return Entry(declared.key, Mapping(tuple(kept.values()), given.value.span))


def _static(entry: Entry) -> StaticTransform:
    tree = mapping(entry)
    angles = (number(item.value) for item in entries(tree.get("rotation_rad")))
    return StaticTransform(
        key(entry),
        text_or_opaque(tree.get("parent"), entry.key.span),
        _values(entry, tree),
        flag(tree.get("from_code"), default=False),
        tuple(angle for angle in angles if angle is not None),
    )


def _values(entry: Entry, tree: Mapping) -> Located[Transform] | None:
    """Return the pose, if there is one. Coordinates that are not known are 0."""
    translation = tree.get("translation_m")
    rotation = next((found for name in _ROTATIONS if (found := tree.entry(name))), None)
    if translation is None and rotation is None:
        return None
    span = entry.key.span if rotation is None else rotation.key.span
    return Located(Transform(_vector(translation, ("x", "y", "z")), _rotation(rotation)), span)


def _rotation(entry: Entry | None) -> Quaternion:
    if entry is None:
        return IDENTITY.rotation
    if entry.name == "quaternion":
        *_, w = _numbers(entry.value, ("w",))
        return Quaternion(*_vector(entry.value, ("x", "y", "z")), w)
    angles = _vector(entry.value, _ANGLES)
    if entry.name == "rotation_deg":
        angles = (math.radians(angles[0]), math.radians(angles[1]), math.radians(angles[2]))
    return quaternion_of_angles(*angles)


def _vector(tree: Tree | None, names: tuple[str, str, str]) -> Vector:
    x, y, z = _numbers(tree, names)
    return x, y, z


def _numbers(tree: Tree | None, names: tuple[str, ...]) -> Iterator[float]:
    values = {item.name: number(item.value) for item in entries(tree)}
    for name in names:
        found = values.get(name)
        yield 0.0 if found is None else float(found.value)


def _dynamic(entry: Entry) -> DynamicTransform:
    tree = mapping(entry)
    parent = text_or_opaque(tree.get("parent"), entry.key.span)
    return DynamicTransform(key(entry), parent, text(tree.get("from")))
