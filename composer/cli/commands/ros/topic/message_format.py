"""The format options of ``compose topic echo``, named as in ros2."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from composer.base.fast_dataclass import dataclass
from composer.cli.commands.ros.topic.option_groups import option_group
from composer.cli.support.errors import UsageError
from composer.cli.support.output.results import as_json, as_yaml

_MAX_LENGTH = 128


@dataclass(frozen=True, slots=True)
class MessageFormat:
    """How to print messages. Raises UsageError for two formats at once."""

    json: Annotated[bool, typer.Option("--json", help="One JSON object per line.")] = False
    csv: Annotated[
        bool, typer.Option("--csv", help="Comma-separated values, one line per message.")
    ] = False
    flow_style: Annotated[
        bool, typer.Option("--flow-style", help="YAML in flow style, one line per message.")
    ] = False
    full_length: Annotated[
        bool, typer.Option("--full-length", "-f", help="Do not truncate arrays and strings.")
    ] = False
    truncate_length: Annotated[
        int,
        typer.Option(
            "--truncate-length",
            "-l",
            min=1,
            metavar="N",
            help="Truncate arrays and strings to N items.",
        ),
    ] = _MAX_LENGTH
    no_arr: Annotated[
        bool, typer.Option("--no-arr", help="Print the length of arrays instead of the items.")
    ] = False
    no_str: Annotated[
        bool, typer.Option("--no-str", help="Print the length of strings instead of the text.")
    ] = False

    def __post_init__(self) -> None:
        if self.json + self.csv + self.flow_style > 1:
            raise UsageError("only one of --json, --csv and --flow-style can be used")

    @property
    def is_one_line(self) -> bool:
        """Whether a format was chosen that prints each message on one line."""
        return self.json or self.csv or self.flow_style

    def text(self, plain: Any) -> str:
        """Return a message, or a part of one, as text. JSON and CSV are never truncated."""
        shown = without(str, plain) if self.no_str else plain
        shown = without(list, shown) if self.no_arr else shown
        if self.json:
            return as_json(shown)
        if self.csv:
            return as_csv(shown)
        shown = shown if self.full_length else truncated(shown, self.truncate_length)
        return f"{as_yaml(shown, one_line=self.flow_style)}\n---"


#: For commands with a parameter ``message_format``, which is a MessageFormat.
format_options = option_group("message_format", MessageFormat)


def as_csv(value: Any) -> str:
    """Return all scalars of plain data, in order, as one line of CSV (RFC 4180)."""
    import csv
    import io

    line = io.StringIO()
    csv.writer(line, lineterminator="").writerow(_scalars(value))
    return line.getvalue()


def without(kind: type[str | list[Any]], value: Any) -> Any:
    """Return plain data with its strings, or its lists, replaced by their lengths."""
    if isinstance(value, kind):
        return f"<{len(value)} {'characters' if kind is str else 'items'}>"
    if isinstance(value, dict):
        return {name: without(kind, item) for name, item in value.items()}
    if isinstance(value, list):
        return [without(kind, item) for item in value]
    return value


def truncated(value: Any, max_length: int) -> Any:
    """Return plain data with lists and strings truncated to ``max_length`` items."""
    if isinstance(value, dict):
        return {name: truncated(item, max_length) for name, item in value.items()}
    if isinstance(value, list):
        shown = [truncated(item, max_length) for item in value[:max_length]]
        return shown if len(value) <= max_length else [*shown, f"... {len(value)} items"]
    if isinstance(value, str) and len(value) > max_length:
        return f"{value[:max_length]}..."
    return value


def _scalars(value: Any) -> list[Any]:
    match value:
        case dict():
            return [scalar for item in value.values() for scalar in _scalars(item)]
        case list():
            return [scalar for item in value for scalar in _scalars(item)]
        case _:
            return [value]
