"""What one can choose about a diagram. The command line names it without importing the graphs."""

from __future__ import annotations

from enum import StrEnum


class View(StrEnum):
    """The view of a system."""

    NODES = "nodes"
    CONNECTIONS = "connections"
    LIFECYCLE = "lifecycle"
    DEPLOYMENT = "deployment"
    STATES = "states"
    FRAMES = "frames"


class Format(StrEnum):
    """The format of a diagram."""

    MERMAID = "mermaid"
    SVG = "svg"
    PNG = "png"
    JSON = "json"
    HTML = "html"


#: The formats by the suffix of a file name.
FORMATS_BY_SUFFIX = {
    ".mmd": Format.MERMAID,
    ".mermaid": Format.MERMAID,
    ".svg": Format.SVG,
    ".png": Format.PNG,
    ".json": Format.JSON,
    ".html": Format.HTML,
    ".htm": Format.HTML,
}
