"""Values with a place in a file, and hosts, for the tests of what comes from no file."""

from __future__ import annotations

from typing import TypeVar

from composer.base.source import Located, SourceFile, Span
from composer.model import Host

T = TypeVar("T")
SPAN = Span(SourceFile("robot.yaml"), 1, 1)


def located(value: T) -> Located[T]:
    return Located(value, SPAN)


def host(workspace: str = "~/robot", /, **settings: object) -> Host:
    """Return the host ``jetson``."""
    given = {"address": located("10.0.0.5"), "workspace": located(workspace), **settings}
    return Host(name=located("jetson"), span=SPAN, **given)  # type: ignore[arg-type]
