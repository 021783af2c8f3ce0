"""What somebody means who names an interface that is not there."""

from __future__ import annotations

from collections.abc import Collection

from composer.diagnostics import nearest, suggestion


def similar_interface(name: str, known: Collection[str]) -> str | None:
    """Return a hint at what among ``known`` was most likely meant by ``name``, or None."""
    package, slash, _ = name.partition("/")
    beside = [other for other in known if other.startswith(f"{package}/")]
    alike = [other for other in known if _stem(other) == _stem(name)]
    found = [other for other in alike if not beside or other in beside]
    if not found:
        by_stem = {_stem(other): other for other in (beside if slash else known)}
        close = nearest(_stem(name), by_stem)
        found = alike or beside if close is None else [by_stem[close]]
    return f"did you mean '{found[0]}'?" if len(found) == 1 else suggestion(_stem(name), found)


def _stem(name: str) -> str:
    return name.rpartition("/")[2]
