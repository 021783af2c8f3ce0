"""Files that are not valid Python."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python_nodes import behaviors, hosted_classes
from composer.diagnostics import Diagnostic, Label
from composer.rules.python.definitions import error, on_tick
from composer.source import Span

PYTHON_SYNTAX = error(
    code="RC441",
    name="python-syntax",
    summary="The module of a behavior or class is not valid Python.",
    why=(
        "The node cannot be created. The module is compiled and not executed, so that all "
        "errors of Python's compiler are found, such as 'await' outside an async function."
    ),
    bad=on_tick("await self.clock.sleep(0.05)"),
    good=on_tick("await self.clock.sleep(0.05)", is_async=True),
)
#: The Python of ROS 2 Jazzy.
_JAZZY = (3, 12)
#: Statements that are new in it: ``type``, and functions and classes with type parameters.
_NEWER_SYNTAX = re.compile(r"^\s*(type\s+\w+|(async\s+)?def\s+\w+\s*\[|class\s+\w+\s*\[)")


def check(context: Context) -> Iterator[Diagnostic]:
    """Report the first error of each module."""
    reported: set[Span] = set()
    sources = [(source, "behavior") for _, source in behaviors(context)]
    sources += [(item.source, "class") for item in hosted_classes(context)]
    for source, what in sources:
        place = source.reference.text.span
        if source.problem is not None and source.problem_span is not None:
            message = f"module '{source.reference.module}' {source.problem}"
            label = Label(place, f"the {what} of this node")
            yield _diagnostic(message, source.problem_span, label)
        for message, span in source.broken:
            if span not in reported:
                reported.add(span)
                yield _diagnostic(
                    message, span, Label(place, f"the {what} of this node imports it")
                )


def _diagnostic(message: str, span: Span, label: Label) -> Diagnostic:
    is_newer = "f-string" in message or _NEWER_SYNTAX.search(span.file.line(span.line))
    hint = None
    if is_newer and sys.version_info[:2] < _JAZZY:
        here, jazzy = (".".join(map(str, version[:2])) for version in (sys.version_info, _JAZZY))
        hint = f"Python {here} reads the file here; this syntax may need {jazzy}, that of Jazzy"
    return Diagnostic(PYTHON_SYNTAX, message, span, (label,), hint)
