"""How messages are printed: the options of ``compose topic echo``, as ros2 has them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import typer

from composer.cli.support.failure import UsageFailure
from composer.cli.support.option_groups import option_group
from composer.cli.support.values import CUT_AT, as_csv, as_json, as_yaml, cut, without


@dataclass(frozen=True, slots=True)
class MessageFormat:
    """What the options say. Raises UsageFailure for two formats at once."""

    json: Annotated[bool, typer.Option("--json", help="One JSON object a line.")] = False
    csv: Annotated[bool, typer.Option("--csv", help="One line of comma-separated values.")] = False
    flow_style: Annotated[bool, typer.Option("--flow-style", help="One line of YAML.")] = False
    full_length: Annotated[
        bool, typer.Option("--full-length", "-f", help="Do not cut long lists and texts.")
    ] = False
    truncate_length: Annotated[
        int, typer.Option("--truncate-length", "-l", min=1, metavar="N", help="Cut them at N.")
    ] = CUT_AT
    no_arr: Annotated[bool, typer.Option("--no-arr", help="Only the length of lists.")] = False
    no_str: Annotated[bool, typer.Option("--no-str", help="Only the length of texts.")] = False

    def __post_init__(self) -> None:
        if self.json + self.csv + self.flow_style > 1:
            raise UsageFailure("--json, --csv and --flow-style are three formats: choose one")

    def text(self, plain: Any) -> str:
        """Return a message, or a part of one, as it is printed; for programs nothing is cut."""
        shown = without(str, plain) if self.no_str else plain
        shown = without(list, shown) if self.no_arr else shown
        if self.json:
            return as_json(shown)
        if self.csv:
            return as_csv(shown)
        shown = shown if self.full_length else cut(shown, self.truncate_length)
        return f"{as_yaml(shown, one_line=self.flow_style)}\n---"


#: For commands with a parameter ``message_format``, which is a MessageFormat.
takes_format_options = option_group("message_format", MessageFormat)
