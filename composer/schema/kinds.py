"""The two kinds of file there are, and what is said of one that is neither or the other."""

from __future__ import annotations

from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.schema import kind_of
from composer.source import SourceFile
from composer.tree import Mapping

SYSTEM = "system"
NODE = "node"

RULE = register(
    Rule(
        code="RC040",
        name="wrong-kind-of-file",
        severity=Severity.ERROR,
        summary="A file is neither a system nor a node type, or not the one that is needed.",
        why=(
            "The first key of a file says what it is: `system:` or `node:`. Without it nobody can "
            "tell what the rest means."
        ),
        bad="nodes: {talker: {}}",
        good="system: demo\nnodes: {talker: {}}",
    )
)

_WORDS = {SYSTEM: "a system", NODE: "a node type"}


def check_kind(
    tree: Mapping, source: SourceFile, allowed: tuple[str, ...] = (SYSTEM, NODE)
) -> Diagnostic | None:
    """Return what is wrong with the kind of a file; None when it is one of ``allowed``."""
    kind = kind_of(tree)
    if kind in allowed:
        return None
    entry = (tree.entry(kind) if kind is not None else None) or next(iter(tree), None)
    wanted = " or ".join(_WORDS[name] for name in allowed)
    if kind is None:
        message = f"'{source.path}' is neither a system nor a node type"
    else:
        message = f"'{source.path}' is {_WORDS.get(kind, kind)}, not {wanted}"
    keys = " or ".join(f"'{name}: <name>'" for name in allowed)
    return Diagnostic(
        RULE,
        message,
        entry.key.span if entry is not None else tree.span,
        hint=f"{wanted} begins with {keys}",
    )
