"""The texts of files that exports and new files have in common, with places for values."""

from __future__ import annotations

import re
from pathlib import Path

#: A line that is only ``@name@`` is replaced by any number of lines.
_PLACE = re.compile(r"(?m)^@(\w+)@\n|@(\w+)@")


def filled(template: str, **values: str) -> str:
    """Return the text of a template, such as ``systemd/service``, with its values."""
    text = (Path(__file__).parent / f"{template}.in").read_text(encoding="utf-8")
    return _PLACE.sub(lambda match: values[match[1] or match[2]], text)
