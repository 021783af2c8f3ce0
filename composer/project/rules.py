"""The rules for settings and folders (RC042, RC044)."""

from __future__ import annotations

from composer.diagnostics import error, warning

BAD_SETTING = error(
    code="RC042",
    name="bad-setting",
    summary="A setting of the project, in composer.yaml, is invalid.",
    why=(
        "The setting would silently have no effect: node types would not be found, or the "
        "wrong rule ignored."
    ),
    bad="ignore: [qos-implict]  # composer.yaml",
    good="ignore: [qos-implicit]  # composer.yaml",
)

FOREIGN_OWNER = warning(
    code="RC044",
    name="foreign-owner",
    summary="Settings or node types in a parent folder belong to another user and are ignored.",
    why=(
        "A system runs the Python of its node types. Another user could place them in a folder "
        "above yours that everyone can write to."
    ),
    bad="""\
shared/nodes/              # of another user
shared/mine/system.yaml
""",
    good="""\
shared/mine/nodes/
shared/mine/system.yaml
""",
)
