"""A behavior in a ``BehaviorTest`` does what it does in the real runtime."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from composer.behavior import GoalRejected
from composer.testing import BehaviorTest, SystemTest
from tests.examples import examples

#: What else the system has, by node type: the servers that the test of the behavior stands for.
SERVERS = {
    "motor_controller": """
  planner:
    type: service_stub
    services: {service: {service: plan_trajectory}}
    variables:
      service_type: composer_interfaces/srv/PlanTrajectory
      response: {success: false, message: no way}
""",
    "navigate_client": """
  navigator:
    type: action_stub
    action_servers: {action: {action: navigate}}
    variables:
      action_type: composer_interfaces/action/Navigate
      accept: goal.target.x < 5.0
      steps: 4
      feedback: {progress_percent: "{25.0 * count}"}
      result: {message: there}
""",
}


class Node:
    """A node of one type: alone, or in a system that has nothing else but its servers."""

    def __init__(self, test: Any, name: str) -> None:
        """Activate the node; ``name`` is its name in a system."""
        self.test = test
        self._prefix = "/" if name else ""
        self._node = (name,) if name else ()
        self.send = test.publish if name else test.send
        # The times are those since the activation.
        self.act("transition", "deactivate")
        self.act("transition", "activate")
        self._start_s = test.now_s

    def port(self, verb: str, port: str, *arguments: Any) -> Any:
        """Call a method of the test that takes the name of a port."""
        return getattr(self.test, verb)(f"{self._prefix}{port}", *arguments)

    def act(self, verb: str, *arguments: Any) -> None:
        """Call a method of the test that takes the name of a node."""
        getattr(self.test, verb)(*self._node, *arguments)

    def publish(self, port: str, message: Any) -> None:
        """Send a message to the node."""
        self.send(f"{self._prefix}{port}", message)
        self.test.advance(0.0)

    def transform(self, parent: str, child: str, x: float) -> None:
        """Let the node know a transform."""
        if not self._prefix:
            self.test.set_transform(parent, child, (x, 0.0, 0.0))
            return
        transform = {"translation": {"x": x}, "rotation": {"w": 1.0}}
        header = {"frame_id": parent}
        item = {"header": header, "child_frame_id": child, "transform": transform}
        self.publish("tf_static", {"transforms": [item]})

    def seen(self, port: str) -> list[Any]:
        """Return the messages of a publisher: the times, and the values of all fields."""
        messages = self.port("messages", port)
        return [
            value
            for item in messages
            if item.time_s >= self._start_s
            for value in (item.time_s - self._start_s, *values(item.message))
        ]

    def log(self) -> list[str]:
        """Return the log of the node."""
        names = [f"/{name}" for name in self._node]
        lines = [line for line in self.test.log if line.node in names or not names]
        return [f"{line.level} {line.text}" for line in lines]


def values(message: Any) -> Iterator[Any]:
    """Yield the values of a message, without stamps: the nodes are not activated at one time."""
    if hasattr(message, "get_fields_and_field_types"):
        for name in message.get_fields_and_field_types():
            if name != "stamp":
                yield from values(getattr(message, name))
    elif isinstance(message, list):
        for item in message:
            yield from values(item)
    elif not hasattr(message, "tolist"):
        yield message


def check(
    folder: Path, node_type: str, act: Callable[[Node], list[Any]], **parameters: Any
) -> None:
    """Check that a node alone and a node in a system do the same."""
    path = folder / f"{node_type}.yaml"
    system = (
        f"system: one\nnodes:\n  {node_type}: {{type: {node_type}}}\n{SERVERS.get(node_type, '')}"
    )
    path.write_text(system, encoding="utf-8")
    settings = {f"{node_type}.{name}": value for name, value in parameters.items()}
    with SystemTest(path, settings=settings) as test:
        expected = act(Node(test, node_type))
    with BehaviorTest(node_type, parameters=parameters) as alone:
        if node_type == "motor_controller":
            alone.answer("plan_trajectory", {"message": "no way"})
        if node_type == "navigate_client":
            alone.answer("navigate", drive(alone), accept=lambda goal: goal.target.x < 5.0)
        assert act(Node(alone, "")) == pytest.approx(expected, abs=1e-5)


def drive(test: BehaviorTest) -> Callable[[Any], Any]:
    async def answer(goal: Any) -> dict[str, str]:
        for step in range(4):
            if goal.is_cancel_requested:
                break
            goal.publish_feedback({"progress_percent": 25.0 * step})
            await test.sleep(0.1)
        return {} if goal.is_cancel_requested else {"message": "there"}

    return answer


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("systems")


delays = st.integers(0, 40).map(lambda step: step / 80 + 0.001)
speeds = st.integers(-20, 20).map(lambda step: step / 10)


@examples(6)
@given(commands=st.lists(st.tuples(delays, speeds, speeds), max_size=5), rate_hz=st.integers(5, 60))
def test_the_simulator(folder: Path, commands: list[tuple[float, ...]], rate_hz: int) -> None:
    def act(node: Node) -> list[Any]:
        for delay_s, x, y in commands:
            node.publish("motor_commands", {"linear": {"x": x, "y": y}})
            node.test.advance(delay_s)
        node.act("set_parameter", "rate_hz", 10.0)
        node.test.advance(1.05)
        return node.seen("sensor_data")

    check(folder, "sensor_simulator", act, rate_hz=float(rate_hz))


@examples(6)
@given(requests=st.lists(st.tuples(st.booleans(), speeds, speeds), max_size=6))
def test_the_planner(folder: Path, requests: list[tuple[bool, float, float]]) -> None:
    def act(node: Node) -> list[Any]:
        responses: list[Any] = []
        for has_odometry, x, velocity in requests:
            if has_odometry:
                node.publish("sensor_data", {"header": {"frame_id": "odom"}})
            request = {"goal": {"x": x}, "max_velocity": velocity}
            responses += values(node.port("call", "plan_trajectory", request))
        node.act("transition", "deactivate")
        return [*responses, *values(node.port("call", "plan_trajectory"))]

    check(folder, "planner", act)


@examples(6)
@given(goals=st.lists(st.tuples(speeds, speeds, delays, st.booleans()), min_size=1, max_size=4))
def test_the_navigator(folder: Path, goals: list[tuple[float, float, float, bool]]) -> None:
    def act(node: Node) -> list[Any]:
        seen: list[Any] = []
        sent = []
        for x, velocity, delay_s, cancels in goals:
            goal = node.port(
                "send_goal", "navigate", {"target": {"x": x}, "max_velocity": velocity}
            )
            node.test.advance(delay_s)
            with suppress(GoalRejected):
                if cancels:
                    seen.append(goal.cancel())
            sent.append(goal)
        node.test.advance(1.0)
        node.act("transition", "deactivate")
        for goal in sent:
            seen += [value for item in goal.feedback for value in values(item)]
            if goal.is_accepted:
                ended = goal.result()
                seen += [ended.status, *values(ended.result)]
        return seen

    check(folder, "navigator", act)


@pytest.mark.parametrize("x", [1.0, 9.0])
@pytest.mark.parametrize("cancel_at_percent", [0.0, 50.0])
@pytest.mark.parametrize("stops", [False, True])
def test_the_client_of_an_action(
    folder: Path, x: float, cancel_at_percent: float, stops: bool
) -> None:
    def act(node: Node) -> list[Any]:
        node.test.advance(0.25)
        if stops:
            node.act("transition", "deactivate")
        node.test.advance(1.0)
        return [*node.seen("outcome"), *node.log()]

    check(folder, "navigate_client", act, target=[x, 0.0], cancel_at_percent=cancel_at_percent)


def test_the_client_of_a_service(folder: Path) -> None:
    def act(node: Node) -> list[Any]:
        goal = node.port("send_goal", "navigate", {"target": {"x": 1.0}, "max_velocity": 1.0})
        node.test.advance(1.0)
        node.publish("sensor_data", {"pose": {"pose": {"position": {"x": 0.5}}}})
        node.test.advance(4.0)
        ended = goal.result()
        return [ended.status, *values(ended.result), *node.seen("motor_commands"), *node.log()]

    check(folder, "motor_controller", act)


def test_transforms(folder: Path) -> None:
    def act(node: Node) -> list[Any]:
        node.transform("map", "laser", 1.0)
        for frame in ("laser", "lasers"):
            node.publish("detections", {"header": {"frame_id": frame}, "point": {"x": 2.0}})
            node.test.advance(0.5)
        return [*node.seen("obstacles"), *node.log()]

    check(folder, "obstacle_finder", act)
