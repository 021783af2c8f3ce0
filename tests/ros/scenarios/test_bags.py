"""Scenarios with bags: a step that replays one, and the bags of failed runs."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from builtin_interfaces.msg import Time
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from composer.bags.bag import BagError
from composer.bags.reader import open_bag
from composer.scenarios.runner import Result
from composer.testing import SystemTest
from composer.testing.bag_messages import shift_stamps
from composer.testing.declarations import load_file
from tests.ros.scenarios.conftest import compose_in, copied_to, run

REPLAY = "replay: {bag: ../bag, replace: [sensor_simulator]"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory, shared_domain_id: int) -> Path:
    """A project with five seconds of the pipeline in its folder ``bag``."""
    project = copied_to(tmp_path_factory.mktemp("project"))
    with SystemTest(project / "systems" / "pipeline.yaml", record_to=project / "bag") as system:
        system.advance(5.0)
    [line] = system.recorded
    assert line.endswith(f" messages: {project / 'bag'}")
    return project


def _run(project: Path, text: str) -> Result:
    path = project / "scenarios" / "test.yaml"
    path.write_text(f"scenario: test\nsystem: pipeline\nfor_s: 4\n{text}")
    return run(path)


@pytest.mark.parametrize(
    "text",
    [
        # The first message is as old for the planner as in the recorded run.
        f"steps: [{{at_s: 2, {REPLAY}}}, expect: [{{message: /motor_commands, within_s: 0.2}}]}}]",
        f"steps: [{{{REPLAY}, topics: ['/sensor_*']}}, drop: {{/sensor_data: {{}}}},"
        " expect: [{silence: /motor_commands, where: message.linear.x != 0.0}]}]",
    ],
)
def test_a_step_replays_a_bag(text: str, recorded: Path) -> None:
    result = _run(recorded, text)
    assert [(item.expected, item.seen) for item in result.failures] == []


def test_a_part_of_a_bag(recorded: Path) -> None:
    loaded, _ = load_file(recorded / "systems" / "pipeline.yaml", {}, {})
    with SystemTest(loaded.without_nodes(["sensor_*"]), record_to=recorded / "second") as system:
        replay = system.replay(recorded / "bag", ["/sensor_*"], start_s=1.0, duration_s=2.0)
        system.run_until(replay.done, 2.0)
        with pytest.raises(BagError, match="has no topic that pipeline only receives"):
            system.replay(recorded / "bag", ["/motor_commands"])
    assert open_bag(recorded / "second").summary.counts["/sensor_data"] == 60


def test_stamps_have_the_time_of_the_run() -> None:
    moved, unset = TransformStamped(), TransformStamped()
    moved.header.stamp = Time(sec=7, nanosec=900_000_000)
    message = TFMessage(transforms=[moved, unset])
    shift_stamps(message, 200_000_000)
    stamps = [(item.header.stamp.sec, item.header.stamp.nanosec) for item in message.transforms]
    assert stamps == [(8, 100_000_000), (0, 0)]


def with_damaged_chunks(data: bytes) -> bytes:
    """Return a bag with zeros in the data of messages.

    In each chunk: one ends each second of real time, so a topic may be missing in any of them.
    """
    damaged, at = bytearray(data), 8  # after the magic bytes
    while at < len(data) - 8:  # an operation, the length of a record, and the record
        end = at + 9 + int.from_bytes(data[at + 1 : at + 9], "little")
        if data[at] == 6:
            middle = (at + end) // 2
            damaged[middle : middle + 20] = bytes(20)
        at = end
    return bytes(damaged)


@pytest.mark.parametrize(
    ("damage", "text"),
    [(lambda _: b"", "is empty"), (with_damaged_chunks, "is corrupt or not supported")],
)
def test_a_damaged_bag_fails_the_step(
    damage: Callable[[bytes], bytes], text: str, recorded: Path
) -> None:
    damaged = recorded / text.replace(" ", "_")
    shutil.copytree(recorded / "bag", damaged)
    [file] = damaged.glob("*.mcap")
    file.write_bytes(damage(file.read_bytes()))
    replay = REPLAY.replace("../bag", f"../{damaged.name}")
    [failure] = _run(recorded, f"steps: [{{{replay}}}}}]\nallow_errors: true").failures
    assert failure.expected == "'replay' to work"
    assert text in failure.seen


def test_a_failed_run_leaves_a_bag(project: Path) -> None:
    (project / "scenarios" / "wrong.yaml").write_text(
        "scenario: too fast\nsystem: pipeline\nfor_s: 5\n"
        "steps: [{at_s: 2, publish: {/sensor_data: {}}}]\n"
        "expect: [{message: /motor_commands, where: message.linear.x > 9}]\n"
    )
    output = compose_in(project, "test", "--bag-on-failure", "-k", "minimal or wrong").stdout
    assert "passed  scenarios/minimal.yaml" in output
    [folder] = (project / "bags").iterdir()
    [bag] = folder.iterdir()
    assert f" messages: {bag.relative_to(project)}" in output
    assert open_bag(bag).summary.counts["/sensor_data"] == 151
    words = ("replay", bag, "systems/pipeline.yaml", "--replace", "sensor_simulator")
    done = compose_in(project, *words, "--compare", bag)
    assert "equal to the messages of the bag" in done.stdout
    compose_in(project, "test", "--bag-on-failure", "-k", "minimal")
    assert list((project / "bags").iterdir()) == [folder]
