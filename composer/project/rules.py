"""The rule for settings (RC042)."""

from __future__ import annotations

from composer.diagnostics import Rule, Severity, register

BAD_SETTING = register(
    Rule(
        code="RC042",
        name="bad-setting",
        severity=Severity.ERROR,
        summary="A setting of the project, in composer.yaml or pyproject.toml, is invalid.",
        why=(
            "The setting would silently have no effect: node types would not be found, or the "
            "wrong rule ignored."
        ),
        bad="ignore: [qos-implict]  # composer.yaml",
        good="ignore: [qos-implicit]  # composer.yaml",
    )
)
