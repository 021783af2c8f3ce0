"""Draw the diagrams in docs/pictures with ``compose graph``."""

from __future__ import annotations

from pathlib import Path

from composer.graph import View, build_graph, scene_of
from composer.graph.output import Engine, Format, render
from composer.loading import load

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "docs" / "pictures"

#: The systems and their views.
PICTURES = (
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


def pictures() -> dict[str, bytes]:
    """Return the SVG images by file name. They are identical on all machines."""
    return {f"{system}-{view}.svg": _drawn(system, view) for system, view in PICTURES}


def _drawn(name: str, view: View) -> bytes:
    path = ROOT / "systems" / f"{name}.yaml"
    loading = load(path, shown=f"systems/{name}.yaml")
    if loading.system is None:
        raise SystemExit(f"{path} cannot be drawn")
    graph = build_graph(scene_of([loading.system], loading.diagnostics), view)
    return render([graph], Format.SVG, Engine.BUNDLED)


def main() -> None:
    """Write all diagrams."""
    FOLDER.mkdir(exist_ok=True)
    for name, drawn in pictures().items():
        (FOLDER / name).write_bytes(drawn)


if __name__ == "__main__":
    main()
