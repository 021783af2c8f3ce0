"""The colors of pictures on light and dark pages, one hue per kind of channel."""

from __future__ import annotations

from collections.abc import Mapping

from composer.graph.diagram import Mark

#: name -> (on a light page, on a dark page)
_PLAIN = {
    "page": ("#ffffff", "#0b1220"),
    "text": ("#0f172a", "#e2e8f0"),
    "faint": ("#475569", "#94a3b8"),
    "frame": ("#f8fafc", "#111a2c"),
    "frame-line": ("#cbd5e1", "#334155"),
    Mark.WRONG: ("#dc2626", "#f87171"),
    Mark.DOUBTFUL: ("#ca8a04", "#fde047"),
}

#: kind -> (fill, line) on a light page, then on a dark page
_KINDS = {
    "node": (("#dbeafe", "#1d4ed8"), ("#172c54", "#60a5fa")),
    "topic": (("#dcfce7", "#15803d"), ("#0f3321", "#4ade80")),
    "service": (("#ffedd5", "#c2410c"), ("#43210f", "#fb923c")),
    "action": (("#f3e8ff", "#7e22ce"), ("#321a4d", "#c084fc")),
    "port": (("#f1f5f9", "#64748b"), ("#1e293b", "#94a3b8")),
    "state": (("#e2e8f0", "#475569"), ("#1e293b", "#94a3b8")),
    "coordinate_frame": (("#fef9c3", "#a16207"), ("#3a2d06", "#facc15")),
    "dependency": (("none", "#475569"), ("none", "#94a3b8")),
    "implied": (("none", "#475569"), ("none", "#94a3b8")),
    "transition": (("none", "#475569"), ("none", "#94a3b8")),
    "transform": (("none", "#a16207"), ("none", "#facc15")),
}
#: Everything about a picture but its colors.
FORMS = (
    'text{font-family:"Helvetica Neue",Helvetica,Arial,"Liberation Sans",sans-serif;'
    "font-size:12px;text-anchor:middle}"
    ".title{font-size:14px;font-weight:600;text-anchor:start}"
    ".faint,.edge-label,.row-end{font-size:10px}"
    ".row{text-anchor:start}"
    ".row-end{text-anchor:end}"
    ".frame-label{font-size:10px;text-anchor:start}"
    ".frame{stroke-width:1}"
    ".shape{stroke-width:1.2}"
    ".shape.port{stroke-width:.8}"
    ".edge{fill:none;stroke-width:1.3}"
    ".edge.service,.edge.implied{stroke-dasharray:5 3}"
    ".edge.action{stroke-width:2.2}"
)


def colors(*, dark: bool) -> dict[str, str]:
    """Return all colors by name: ``page``, ``text``, ..., ``node`` (fill), ``node-line``."""
    side = int(dark)
    named = {name: both[side] for name, both in _PLAIN.items()}
    for kind, both in _KINDS.items():
        named[kind], named[f"{kind}-line"] = both[side]
    return named


#: For formats without style sheets.
LIGHT_COLORS = colors(dark=False)


def color_rules(color: Mapping[str, str]) -> str:
    """Return the rules of a style sheet that give every part of a picture its color."""
    rules = [
        f".page{{fill:{color['page']}}}",
        f"text{{fill:{color['text']}}}",
        f".faint,.row-end,.frame-label,.edge-label{{fill:{color['faint']}}}",
        f".frame{{fill:{color['frame']};stroke:{color['frame-line']}}}",
        f".label-back{{fill:{color['page']};fill-opacity:.9}}",
    ]
    for kind in _KINDS:
        line = color[f"{kind}-line"]
        rules.append(f".shape.{kind}{{fill:{color[kind]};stroke:{line}}}")
        rules.append(f".edge.{kind}{{stroke:{line}}}")
        rules.append(f".head.{kind}{{fill:{line}}}")
    for mark in Mark:
        rules.append(f".shape.{mark},.edge.{mark}{{stroke:{color[mark]};stroke-width:2.5}}")
        rules.append(f".head.{mark}{{fill:{color[mark]}}}")
    return "".join(rules)


#: The style sheet of a picture that stands alone.
STYLE = (
    FORMS
    + color_rules(colors(dark=False))
    + "@media (prefers-color-scheme:dark){"
    + color_rules(colors(dark=True))
    + "}"
)


def page_style() -> str:
    """Return the style sheet of pictures in a page, whose ``data-theme`` may choose the colors.

    Every color is a variable (``--page``, ``--node-line``), for the rest of the page as well.
    """
    light, dark = (
        "".join(f"--{name}:{value};" for name, value in colors(dark=side).items())
        for side in (False, True)
    )
    names = {name: f"var(--{name})" for name in colors(dark=False)}
    return (
        f":root{{{light}}}"
        f"@media (prefers-color-scheme:dark){{:root:not([data-theme=light]){{{dark}}}}}"
        f":root[data-theme=dark]{{{dark}}}"
        f"@media print{{:root:root{{{light}}}}}"
        f"{FORMS}{color_rules(names)}"
    )
