"""The rule of settings (RC042)."""

from __future__ import annotations

from composer.diagnostics import Rule, Severity, register

BAD_SETTING = register(
    Rule(
        code="RC042",
        name="bad-setting",
        severity=Severity.ERROR,
        summary="A setting of the project, in composer.yaml or pyproject.toml, cannot be used.",
        why=(
            "What was chosen for the whole project would silently not be done: a folder of node "
            "types not found, a rule ignored that was not meant."
        ),
        bad="ignore: [qos-implict]  # composer.yaml",
        good="ignore: [qos-implicit]  # composer.yaml",
    )
)
