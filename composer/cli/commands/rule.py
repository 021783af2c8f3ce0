"""``compose rule``: what a finding means and how to mend it."""

from __future__ import annotations

from typing import Annotated

import typer

from composer.cli.support.failure import UsageFailure
from composer.cli.support.help import examples
from composer.cli.support.terminal import columns, write, write_raw

EPILOG = examples(
    "compose rule                            all rules, one a line",
    "compose rule RC202",
    "compose rule unknown-node",
)


def rule(
    code: Annotated[
        str | None,
        typer.Argument(
            metavar="CODE", help="A code (RC301), a band (RC3) or a name.", show_default=False
        ),
    ] = None,
) -> None:
    """Explain a rule: what is wrong, why it matters, and an example of it and of its cure."""
    from composer.diagnostics import suggestion
    from composer.report.rule_page import all_rules, explain, find_rule

    rules = all_rules()
    found = None if code is None else find_rule(code, rules)
    band = [item for item in rules if code is None or item.code.startswith(code.upper())]
    if found is not None:
        write_raw(explain(found))
    elif band:
        write(columns([(item.code, item.severity.value, item.name) for item in band]))
    else:
        names = [name for item in rules for name in (item.code, item.name)]
        raise UsageFailure(f"no rule is called '{code}'", hint=suggestion(str(code), names))
