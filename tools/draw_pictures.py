"""Draw the diagrams in docs/pictures with ``compose graph``."""

from __future__ import annotations

from pathlib import Path

from composer.graph.output import Format, render
from composer.graph.views import View, build_graph, scene_of
from composer.loading import load

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "docs" / "pictures"

_SHOWN = (
    ("talker_listener", View.NODES),
    ("pipeline", View.NODES),
    ("pipeline", View.CONNECTIONS),
    ("pipeline", View.LIFECYCLE),
    ("pipeline", View.STATES),
    ("executors", View.DEPLOYMENT),
    ("trajectory_service", View.NODES),
    ("navigation", View.NODES),
    ("fleet", View.NODES),
    ("qos_patterns", View.CONNECTIONS),
    ("frames", View.FRAMES),
)
#: The systems and their views, by file name.
PICTURES = {f"{system}-{view}.svg": (system, view) for system, view in _SHOWN}


def drawn(name: str, view: View) -> bytes:
    """Return an SVG image, identical on all machines."""
    path = ROOT / "systems" / f"{name}.yaml"
    loading = load(path, shown=f"systems/{name}.yaml")
    if loading.system is None:
        raise SystemExit(f"{path} cannot be drawn")
    graph = build_graph(scene_of([loading.system], loading.diagnostics), view)
    return render([graph], Format.SVG)


def main() -> None:
    """Write all diagrams."""
    FOLDER.mkdir(exist_ok=True)
    for file, (system, view) in PICTURES.items():
        (FOLDER / file).write_bytes(drawn(system, view))


if __name__ == "__main__":
    main()
