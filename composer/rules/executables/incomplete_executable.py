"""An executable that names no program, or two."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.earlier_errors import is_misspelled
from composer.diagnostics import Diagnostic, error
from composer.model import Executable
from composer.source import Span

RULE = error(
    code="RC473",
    name="incomplete-executable",
    summary="An executable does not have exactly one of command, or package and name.",
    why="There is no program to start, or it is not clear which one.",
    bad="""\
system: maps
nodes:
  map_server:
    executable: {name: map_server, lifecycle: managed}
""",
    good="""\
# file: system.yaml
system: maps
nodes:
  map_server:
    executable: {command: [sh, driver.sh], lifecycle: managed}
# file: driver.sh
exec driver
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check which keys the executables have."""
    for node in context.system.nodes:
        if node.executable is not None:
            yield from _executable(context, node.executable)


def _executable(context: Context, executable: Executable) -> Iterator[Diagnostic]:
    spans: dict[str, Span] = {key.value: key.span for key in executable.given}
    if "command" in spans:
        for name in ("package", "name"):
            if name in spans:
                yield Diagnostic(
                    RULE,
                    f"the executable has a 'command' and a '{name}'",
                    spans[name],
                    hint="keep either 'command', or 'package' and 'name'",
                )
        return
    if is_misspelled(context, "command", executable.span) or _has_unknown_key(context, executable):
        return
    missing = [
        name
        for name in ("package", "name")
        if name not in spans and not is_misspelled(context, name, executable.span)
    ]
    if missing:
        what = "'package' and 'name'" if len(missing) == 2 else f"'{missing[0]}'"
        yield Diagnostic(
            RULE,
            f"the executable has no {what}",
            executable.span,
            hint="write 'executable: {package: ..., name: ...}' or 'executable: {command: [...]}'",
        )


def _has_unknown_key(context: Context, executable: Executable) -> bool:
    """Return whether an earlier error is on the line of the executable, behind its key."""
    start = executable.span
    return any(
        (span.file.path, span.line) == (start.file.path, start.line) and span.column > start.column
        for span in context.refused
    )
