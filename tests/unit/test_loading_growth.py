"""The time that validating takes grows with the size of a file, also of one full of mistakes."""

from __future__ import annotations

import gc
import time
from pathlib import Path

import pytest

from composer.loading import load

SMALL, LARGE = 100, 800
STRING = "type: std_msgs/msg/String"
NODES = f"  node_#: {{publishers: {{a: {{{STRING}}}}}, subscriptions: {{x: {{{STRING}}}}}}}\n"

#: By name: parts of a file, each a heading and a line that is there once for every number; and a
#: rule that finds something in it.
SYSTEMS: dict[str, tuple[list[tuple[str, str]], str]] = {
    "nothing much": (
        [
            ("nodes:\n", NODES),
            ("connections:\n", "  - {topic: /t_#, from: node_#.a, to: node_#.x}\n"),
        ],
        "qos-implicit",
    ),
    "nodes misspelt": (
        [
            ("nodes:\n", NODES),
            ("connections:\n", "  - {topic: /t_#, from: nod_#.a, to: nide_#.x}\n"),
        ],
        "unknown-node",
    ),
    "topics misspelt": (
        [
            ("nodes:\n", f"  talker_#: {{publishers: {{p: {{{STRING}, topic: /topic_#}}}}}}\n"),
            ("", f"  listener_#: {{subscriptions: {{s: {{{STRING}, topic: /topik_#}}}}}}\n"),
        ],
        "unfed-subscription",
    ),
    "profiles misspelt": (
        [
            ("qos_profiles:\n", "  profile_#: {depth: 1}\n"),
            ("nodes:\n", f"  node_#: {{publishers: {{p: {{{STRING}, qos: profil_#}}}}}}\n"),
        ],
        "unknown-qos-profile",
    ),
    "unknown keys": ([("nodes: {one: {}}\n", "key_#: [1, 2, 3]\n")], "unknown-key"),
    "one node with many ports": (
        [("nodes:\n  one:\n    publishers:\n", f"      port_#: {{{STRING}}}\n")],
        "unheard-publisher",
    ),
    "one that all wait for": (
        [("nodes:\n  first: {}\n", "  node_#: {lifecycle: {depends_on: [first]}}\n")],
        "unused-executor",
    ),
}


def write(path: Path, parts: list[tuple[str, str]], count: int) -> None:
    lines = ["system: large\nexecutors: {unused: {kind: single_threaded}}\n"]
    for heading, line in parts:
        lines += [heading, *(line.replace("#", str(number)) for number in range(count))]
    path.write_text("".join(lines))


def seconds(path: Path, rule: str) -> float:
    gc.collect()
    start_s = time.process_time()
    loading = load(path)
    taken_s = time.process_time() - start_s
    assert rule in {diagnostic.rule.name for diagnostic in loading.diagnostics}
    return taken_s


@pytest.mark.slow
@pytest.mark.parametrize(("parts", "rule"), SYSTEMS.values(), ids=SYSTEMS)
def test_growth(tmp_path: Path, parts: list[tuple[str, str]], rule: str) -> None:
    small, large = tmp_path / "small.yaml", tmp_path / "large.yaml"
    write(small, parts, SMALL)
    write(large, parts, LARGE)
    small_s = min(seconds(small, rule) for _ in range(3))
    ratios: list[float] = []
    for _ in range(3):  # what is slow by chance is not so three times
        ratios.append(seconds(large, rule) / small_s)
        if ratios[-1] < 3 * LARGE / SMALL:
            return
    pytest.fail(f"{LARGE // SMALL} times the size takes {ratios} times the time")
