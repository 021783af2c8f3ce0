"""The rules for settings and folders (RC042, RC044)."""

from __future__ import annotations

from composer.diagnostics import error, warning

BAD_SETTING = error("RC042", "bad-setting")

FOREIGN_OWNER = warning("RC044", "foreign-owner")
