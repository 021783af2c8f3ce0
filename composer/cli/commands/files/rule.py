"""``compose rule``: explain the rules of ``compose validate``."""

from __future__ import annotations

from typing import Annotated

import typer

from composer.cli.support.completion import complete_rule
from composer.cli.support.errors import UsageError
from composer.cli.support.options import examples
from composer.cli.support.output.terminal import columns, write, write_raw

EPILOGS = {
    "rule": examples(
        "compose rule                            list all rules",
        "compose rule RC202",
        "compose rule unknown-node",
    )
}


def rule(
    code: Annotated[
        str | None,
        typer.Argument(
            metavar="CODE",
            help="A code (RC301), a code prefix (RC3) or a name.",
            show_default=False,
            autocompletion=complete_rule,
        ),
    ] = None,
) -> None:
    """Explain a rule, with examples.

    Without CODE, list all rules.
    """
    from composer.base.diagnostics import suggestion
    from composer.report.rules import all_rules, explain, find_rule

    rules = all_rules()
    found = None if code is None else find_rule(code, rules)
    matching = [item for item in rules if code is None or item.code.startswith(code.upper())]
    if found is not None:
        write_raw(explain(found))
    elif matching:
        write(columns([(item.code, item.severity.value, item.name) for item in matching]))
    else:
        names = [name for item in rules for name in (item.code, item.name)]
        raise UsageError(f"there is no rule '{code}'", hint=suggestion(str(code), names))
