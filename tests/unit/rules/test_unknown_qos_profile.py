"""QoS profiles that a node type names and the systems that use it declare."""

from __future__ import annotations

from pathlib import Path

from composer.loading import load


def test_a_node_type_may_name_profiles_of_the_systems_that_use_it(tmp_path: Path) -> None:
    (tmp_path / "nodes").mkdir()
    camera = tmp_path / "nodes" / "camera.yaml"
    camera.write_text(
        "node: camera\npublishers: {image: {type: std_msgs/msg/String, qos: images}}\n"
        "timers: {tick: {rate_hz: 1, publish: {image: {data: hello}}}}\n"
    )
    assert load(camera).diagnostics == []
    system = "system: demo\nnodes: {one: {type: camera, publishers: {image: {external: true}}}}\n"
    (tmp_path / "demo.yaml").write_text(system + "qos_profiles: {images: {depth: 1}}\n")
    assert load(tmp_path / "demo.yaml").diagnostics == []
    (tmp_path / "demo.yaml").write_text(system)
    [diagnostic] = load(tmp_path / "demo.yaml").diagnostics
    assert diagnostic.rule.name == "undeclared-name"
