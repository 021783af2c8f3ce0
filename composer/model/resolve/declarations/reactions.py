"""Compile reactions, expressions and templates, and report their errors."""

from __future__ import annotations

from composer.base.diagnostics import Diagnostic, error
from composer.base.source import Located, Span
from composer.language.expressions import Expression, ExpressionError, compile_expression
from composer.language.templates import Template, compile_template
from composer.language.tree import Entry, Mapping, Scalar, Tree
from composer.model import Event, LogLevel, Reaction, Send
from composer.model.resolve.tree_values import entries, is_opaque, key, text

RULE = error("RC440", "invalid-expression")

#: The keys of a reaction of a port, a timer or a lifecycle transition.
KEYS = ("when", "set", "log", "publish", "call", "respond")

NODE_EVENTS = (
    ("on_configure", Event.CONFIGURE),
    ("on_activate", Event.ACTIVATE),
    ("on_deactivate", Event.DEACTIVATE),
    ("on_cleanup", Event.CLEANUP),
)


def expression(tree: Tree | None, diagnostics: list[Diagnostic]) -> Located[Expression] | None:
    """Compile a condition. Its span excludes quotes."""
    if not isinstance(tree, Scalar) or not isinstance(tree.value, str) or is_opaque(tree.value):
        return None
    try:
        compiled = compile_expression(tree.value)
    except ExpressionError as error:
        span = tree.part(error.offset, error.length)
        diagnostics.append(Diagnostic(RULE, error.message, span, hint=error.hint))
        return None
    return Located(compiled, tree.part(0, len(tree.value)))


def template(tree: Tree | None, diagnostics: list[Diagnostic]) -> Template | None:
    """Compile a value that may have ``{...}`` in its texts."""
    if tree is None:
        return None
    compiled, problems = compile_template(tree)
    diagnostics.extend(
        Diagnostic(RULE, problem.message, problem.span, hint=problem.hint) for problem in problems
    )
    return compiled


def has_reaction(tree: Mapping) -> bool:
    """Return whether ``tree`` has any key of a reaction."""
    return any(entry.name in KEYS for entry in tree)


def reaction(tree: Tree | None, span: Span, diagnostics: list[Diagnostic]) -> Reaction | None:
    """Return the reaction that ``tree`` declares, or None."""
    if not isinstance(tree, Mapping) or not has_reaction(tree):
        return None
    when = expression(tree.get("when"), diagnostics)
    log, level = _log(tree.get("log"), diagnostics)
    return Reaction(
        span=span,
        when=when.value if when is not None else None,
        when_span=when.span if when is not None else None,
        state=_templates(tree.get("set"), diagnostics),
        log=log,
        log_level=level,
        publish=_sends(tree.get("publish"), diagnostics),
        call=_sends(tree.get("call"), diagnostics),
        respond=template(tree.get("respond"), diagnostics),
    )


def nested(entry: Entry | None, event: Event, diagnostics: list[Diagnostic]) -> Events:
    """Return the reaction under a separate key, such as ``on_response``."""
    found = reaction(entry.value, entry.key.span, diagnostics) if entry is not None else None
    return ((event, found),) if found is not None else ()


Events = tuple[tuple[Event, Reaction], ...]


def node_reactions(tree: Mapping, diagnostics: list[Diagnostic]) -> Events:
    """Return the reactions of a node to its transitions."""
    return tuple(
        found
        for name, event in NODE_EVENTS
        for found in nested(tree.entry(name), event, diagnostics)
    )


def _templates(
    tree: Tree | None, diagnostics: list[Diagnostic]
) -> tuple[tuple[Located[str], Template], ...]:
    compiled = ((key(entry), template(entry.value, diagnostics)) for entry in entries(tree))
    return tuple((name, value) for name, value in compiled if value is not None)


def _sends(tree: Tree | None, diagnostics: list[Diagnostic]) -> tuple[Send, ...]:
    return tuple(Send(name, content) for name, content in _templates(tree, diagnostics))


def _log(tree: Tree | None, diagnostics: list[Diagnostic]) -> tuple[Template | None, LogLevel]:
    if not isinstance(tree, Mapping):
        return template(tree, diagnostics), LogLevel.INFO
    level = text(tree.get("level"))
    known = level is not None and level.value in {item.value for item in LogLevel}
    return (
        template(tree.get("message"), diagnostics),
        LogLevel(level.value) if level is not None and known else LogLevel.INFO,
    )
