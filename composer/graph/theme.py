"""The colours of pictures on light and dark pages: one hue for each way nodes talk."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class _Colors:
    page: str
    text: str
    faint: str
    frame: str
    frame_line: str
    label: str
    wrong: str
    kinds: dict[str, tuple[str, str]]  # kind -> (fill, line)


_LIGHT = _Colors(
    page="#ffffff",
    text="#0f172a",
    faint="#475569",
    frame="#f8fafc",
    frame_line="#cbd5e1",
    label="#ffffff",
    wrong="#dc2626",
    kinds={
        "node": ("#dbeafe", "#1d4ed8"),
        "topic": ("#dcfce7", "#15803d"),
        "service": ("#ffedd5", "#c2410c"),
        "action": ("#f3e8ff", "#7e22ce"),
        "port": ("#f1f5f9", "#64748b"),
        "state": ("#e2e8f0", "#475569"),
        "dependency": ("none", "#475569"),
        "transition": ("none", "#475569"),
    },
)

_DARK = _Colors(
    page="#0b1220",
    text="#e2e8f0",
    faint="#94a3b8",
    frame="#111a2c",
    frame_line="#334155",
    label="#0b1220",
    wrong="#f87171",
    kinds={
        "node": ("#172c54", "#60a5fa"),
        "topic": ("#0f3321", "#4ade80"),
        "service": ("#43210f", "#fb923c"),
        "action": ("#321a4d", "#c084fc"),
        "port": ("#1e293b", "#94a3b8"),
        "state": ("#1e293b", "#94a3b8"),
        "dependency": ("none", "#94a3b8"),
        "transition": ("none", "#94a3b8"),
    },
)


def _rules(colors: _Colors) -> str:
    rules = [
        f".page{{fill:{colors.page}}}",
        f"text{{fill:{colors.text}}}",
        f".faint,.frame-label,.edge-label{{fill:{colors.faint}}}",
        f".frame{{fill:{colors.frame};stroke:{colors.frame_line}}}",
        f".label-back{{fill:{colors.label};fill-opacity:.85}}",
    ]
    for kind, (fill, line) in colors.kinds.items():
        rules.append(f".shape.{kind}{{fill:{fill};stroke:{line}}}")
        rules.append(f".edge.{kind}{{stroke:{line}}}")
        rules.append(f".head.{kind}{{fill:{line}}}")
    rules.append(f".shape.wrong,.edge.wrong{{stroke:{colors.wrong};stroke-width:2.5}}")
    rules.append(f".head.wrong{{fill:{colors.wrong}}}")
    return "".join(rules)


#: The style sheet of a picture.
STYLE = (
    'text{font-family:"Helvetica Neue",Helvetica,Arial,"Liberation Sans",sans-serif;'
    "font-size:12px;text-anchor:middle}"
    ".title{font-size:14px;font-weight:600;text-anchor:start}"
    ".faint,.edge-label{font-size:10px}"
    ".frame-label{font-size:10px;text-anchor:start}"
    ".frame{stroke-width:1}"
    ".shape{stroke-width:1.2}"
    ".edge{fill:none;stroke-width:1.3}"
    ".edge.service{stroke-dasharray:5 3}"
    ".edge.action{stroke-width:2.2}"
    + _rules(_LIGHT)
    + "@media (prefers-color-scheme:dark){"
    + _rules(_DARK)
    + "}"
)
