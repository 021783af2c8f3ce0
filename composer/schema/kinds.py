"""The two kinds of files, and the diagnostic for a file of the wrong kind."""

from __future__ import annotations

from composer.diagnostics import Diagnostic, error
from composer.schema import kind_of
from composer.source import SourceFile
from composer.tree import Mapping

SYSTEM = "system"
NODE = "node"

RULE = error("RC040", "wrong-kind-of-file")

_WORDS = {SYSTEM: "a system", NODE: "a node type"}


def check_kind(
    tree: Mapping, source: SourceFile, allowed: tuple[str, ...] = (SYSTEM, NODE)
) -> Diagnostic | None:
    """Return a diagnostic if the kind of a file is not one of ``allowed``."""
    kind = kind_of(tree)
    if kind in allowed:
        return None
    entry = (tree.entry(kind) if kind is not None else None) or next(iter(tree), None)
    expected = " or ".join(_WORDS[name] for name in allowed)
    if kind is None:
        message = f"'{source.path}' is neither a system nor a node type"
    else:
        message = f"'{source.path}' is {_WORDS.get(kind, kind)}, not {expected}"
    keys = " or ".join(f"'{name}: <name>'" for name in allowed)
    return Diagnostic(
        RULE,
        message,
        entry.key.span if entry is not None else tree.span,
        hint=f"{expected} begins with {keys}",
    )
