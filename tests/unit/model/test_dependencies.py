"""Nodes that depend on a node, directly or through others."""

from __future__ import annotations

from pathlib import Path

from composer.loading import load
from composer.model.dependencies import dependents

CHAIN = """
system: chain
nodes:
  first: {on_activate: {log: up}}
  second: {on_activate: {log: up}, lifecycle: {depends_on: [first]}}
  third: {on_activate: {log: up}, lifecycle: {depends_on: [second]}}
  other: {on_activate: {log: up}}
"""


def test_dependents_are_found_through_others(tmp_path: Path) -> None:
    path = tmp_path / "chain.yaml"
    path.write_text(CHAIN, "utf-8")
    system = load(path).system
    assert system is not None
    assert dependents(system, "first") == {"second", "third"}
    assert dependents(system, "second") == {"third"}
    assert dependents(system, "other") == frozenset()
