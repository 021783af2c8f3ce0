"""A test drives one behavior in virtual time: what it sends, what it sees, and what it reports."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from composer.behavior import GoalRejected, TransitionFailed
from composer.testing import BehaviorTest, TestFailure
from tests.unit.support.checking import write_files
from tests.unit.testing.tank import BEHAVIOR, INTERFACES, TANK


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project with one node type and interfaces of its own."""
    folder = tmp_path_factory.mktemp("project")
    # No Python class is built for the interfaces of the project.
    files = {f"interfaces/lab/{name}": text for name, text in INTERFACES.items()}
    files |= {"composer.yaml": "", "nodes/tank.yaml": TANK, "nodes/tank.py": BEHAVIOR}
    files["nodes/plain.yaml"] = "node: plain\npublishers: {p: {type: std_msgs/msg/String}}\n"
    files["systems/one.yaml"] = "system: one\nnodes: {tank: {type: tank}}\n"
    files["nodes/wrong.yaml"] = "node: wrong\nbehaviour: tank:Tank\n"
    write_files(folder, files)
    return folder


@pytest.fixture
def tank_type(project: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The name of the node type, for tests in its project."""
    monkeypatch.chdir(project)
    return "tank"


def test_timers_fire_at_their_times(tank_type: str) -> None:
    with BehaviorTest(tank_type, parameters={"size": 2}) as tank:
        tank.advance(0.3)
        assert [item.time_s for item in tank.messages("tanks")] == [0.1, 0.2, 0.3]
        assert tank.now_s == pytest.approx(0.3)
        message = tank.messages("tanks")[-1].message
        assert (message.level.value, message.stamp.nanosec) == (2.0, 300_000_000)
        tank.set_parameter("rate_hz", 2)
        tank.advance(1.0)
        assert [item.time_s for item in tank.messages("tanks")[3:]] == [0.8, 1.3]
        assert tank.behavior.calls[-1] == {"rate_hz": 2.0}
        tank.transition("deactivate")
        tank.advance(1.0)
        assert len(tank.messages("tanks")) == 5


@pytest.mark.parametrize(
    ("variables", "handled"), [({}, (1.0, 3.0, 4.0)), ({"depth": 1}, (1.0, 4.0))]
)
def test_messages_wait_for_an_async_handler_up_to_the_depth(
    tank_type: str, variables: dict[str, int], handled: tuple[float, ...]
) -> None:
    with BehaviorTest(tank_type, variables=variables) as tank:
        for value in (1.0, 2.0, 3.0, 4.0):
            tank.send("levels", {"value": value})
        assert tank.behavior.calls[2:] == (1.0,)
        tank.run_until(lambda: tank.behavior.calls[-1] == 4.0, 10.0)
        assert (tank.behavior.calls[2:], tank.now_s) == (handled, sum(handled[:-1]))


def test_latched_messages_wait_for_the_activation(tank_type: str) -> None:
    with BehaviorTest(tank_type, start=False) as tank:
        with pytest.raises(TestFailure, match="it has ports from 'configure' to 'cleanup'"):
            tank.send("states")
        tank.transition("configure")
        tank.send("states", {"value": 1.0})
        tank.send("levels", {"value": 2.0})
        tank.transition("activate")
        assert tank.behavior.calls == ("configure", "activate", 1.0)
    assert tank.behavior.calls[3:] == ("deactivate", "cleanup", "shutdown")
    assert tank.state == "finalized"


@pytest.mark.parametrize(
    ("parameters", "error", "state", "calls"),
    [
        ({"mode": "fast"}, TransitionFailed, "inactive", ("configure", "activate")),
        ({"size": 0}, OSError, "unconfigured", ("configure", "activate", "error: no tank")),
    ],
)
def test_a_transition_raises_what_its_handler_raises(
    tank_type: str,
    parameters: dict[str, Any],
    error: type[Exception],
    state: str,
    calls: tuple[str, ...],
) -> None:
    with BehaviorTest(tank_type, parameters=parameters, start=False) as tank:
        tank.transition("configure")
        with pytest.raises(error) as raised:
            tank.transition("activate")
        assert raised.traceback[-1].path.name == "tank.py"
        assert (tank.state, tank.behavior.calls) == (state, calls)
    assert tank.state == "finalized"


def test_a_service_responds_and_raises(tank_type: str) -> None:
    with BehaviorTest(tank_type) as tank:
        assert tank.call("fill", {"amount": 5}).success
        assert not tank.call("fill", {"amount": 6}).success
        with pytest.raises(ValueError, match="negative") as raised:
            tank.call("fill", {"amount": -1})
        assert raised.traceback[-1].path.name == "tank.py"
        tank.transition("deactivate")
        assert tank.call("fill").message == "/tank is inactive, not active"
        assert (tank.call("read").value, tank.now_s) == (1.5, 0.5)  # always on
        tank.transition("cleanup")
    with BehaviorTest(tank_type, raise_errors=False) as tank:
        response = tank.call("fill", {"amount": -1})
        assert (response.success, response.message) == (False, "on_fill: ValueError: negative")
        assert tank.log[-1].text == "on_fill: ValueError: negative"


def test_an_exception_of_a_handler_is_raised_where_the_test_is(tank_type: str) -> None:
    with BehaviorTest(tank_type) as tank:
        with pytest.raises(ZeroDivisionError):
            tank.send("states", {"value": -1.0})
        tank.behavior.on_tick = None  # the timer has the old one
        tank.behavior.publishers = None
        with pytest.raises(AttributeError):
            tank.advance(1.0)
        assert tank.now_s == 0.1


def test_a_goal_has_feedback_and_a_result(tank_type: str) -> None:
    with BehaviorTest(tank_type) as tank:
        goal = tank.send_goal("drain", {"amount": 4.0})
        assert goal.is_accepted
        tank.advance(0.5)
        assert [item.done for item in goal.feedback] == [1.0, 2.0]
        assert (goal.result().status, tank.now_s) == ("succeeded", 1.0)
        canceled, waiting = (
            tank.send_goal("drain", {"amount": 4.0}),
            tank.send_goal("drain", {"amount": 4.0}),
        )
        assert waiting.cancel()
        assert waiting.result().status == "canceled"
        assert canceled.cancel()
        assert canceled.result().status == "canceled"
        assert not tank.send_goal("drain").is_accepted
        with pytest.raises(GoalRejected):
            tank.send_goal("drain").result()
        with pytest.raises(RuntimeError, match="leak"):
            tank.send_goal("drain", {"amount": 101.0}).result()
        left = tank.send_goal("drain", {"amount": 4.0})
        tank.transition("deactivate")
        assert left.result().status == "canceled"


def filled(request: Any) -> dict[str, Any]:
    return {"success": True, "message": f"filled {request.amount:g}"}


@pytest.mark.parametrize(
    ("answers", "seen", "at_s"),
    [
        ([], "ServerUnavailable", 1.0),
        ([{"answer": {"message": "ok"}}], "ok", 0.0),
        ([{"answer": {"message": "ok"}, "after_s": 0.5}], "ok", 0.5),
        ([{"answer": {"message": "ok"}, "after_s": 2.0}], "CallTimeout", 1.0),
        ([{"answer": filled}], "filled 1", 0.0),
        ([{"answer": {"message": "1"}}, {"answer": {"message": "2"}}], "2", 0.0),
    ],
)
def test_a_call_is_answered(
    tank_type: str, answers: list[dict[str, Any]], seen: str, at_s: float
) -> None:
    with BehaviorTest(tank_type) as tank:
        for answer in answers:
            tank.answer("valve", **answer)
        tank.send("open")
        tank.run_until(lambda: seen in tank.behavior.calls, 5.0)
        assert tank.now_s == pytest.approx(at_s)
        assert [item.message.amount for item in tank.calls("valve")] == [1.0] * bool(answers)


def test_a_server_that_appears_is_used(tank_type: str) -> None:
    with BehaviorTest(tank_type) as tank:
        tank.send("open")
        tank.advance(0.5)
        tank.answer("valve", {"message": "late"})
        assert tank.behavior.calls[-1] == "late"
        tank.answer("valve", {"message": "never"}, after_s=0.5)
        tank.send("open")
        tank.transition("deactivate")
        assert tank.behavior.calls[-2:] == ("deactivate", "CallCancelled")


def test_a_coroutine_that_lets_no_time_pass_fails(tank_type: str) -> None:
    async def busy(_: Any) -> None:
        while True:
            await tank.sleep(0.0)

    tank = BehaviorTest(tank_type)
    tank.answer("valve", busy)
    tank.transition("configure")
    tank.transition("activate")
    with pytest.raises(TestFailure, match="20,000 calls at 0 s: no time passes"):
        tank.send("open")


@pytest.mark.parametrize(
    ("answer", "kind", "seen", "at_s"),
    [
        (None, 0, ("ServerUnavailable",), 1.0),
        ({"accept": False}, 0, ("GoalRejected",), 0.0),
        ({"accept": lambda goal: goal.amount > 1.0}, 0, ("GoalRejected",), 0.0),
        ({"answer": {"rest": 2}, "after_s": 0.3}, 0, (("succeeded", 2.0),), 0.3),
        ({"answer": {"rest": 2}, "after_s": 9.0}, 3, (True, ("canceled", 2.0)), 0.15),
        ({"answer": "pump"}, 0, (0.5, 1.0, ("succeeded", 3.0)), 0.2),
        ({"answer": "pump"}, 3, (0.5, True, ("canceled", 3.0)), 0.2),
        ({"answer": lambda goal: goal.abort()}, 0, (("aborted", 0.0),), 0.0),
    ],
)
def test_a_goal_of_the_behavior_is_answered(
    tank_type: str, answer: dict[str, Any] | None, kind: int, seen: tuple[Any, ...], at_s: float
) -> None:
    with BehaviorTest(tank_type) as tank:

        async def pump(goal: Any) -> dict[str, float]:
            for step in (1, 2):
                await tank.sleep(0.1)
                if not goal.is_cancel_requested:
                    goal.publish_feedback({"done": goal.request.amount * step / 2})
            return {"rest": 3.0}

        if answer is not None:
            tank.answer(
                "pump", **(answer | ({"answer": pump} if "pump" in answer.values() else {}))
            )
        tank.send("run", {"kind": kind})
        tank.run_until(lambda: tank.behavior.calls[2:] == seen, 5.0)
        assert tank.now_s == pytest.approx(at_s)


@pytest.mark.parametrize(
    ("act", "reason"),
    [
        (lambda tank: tank.send("level"), "no subscription 'level'; did you mean 'levels'?"),
        (lambda tank: tank.send("fill"), "no subscription 'fill'"),
        (lambda tank: tank.messages("tank"), "no publisher 'tank'; did you mean 'tanks'?"),
        (lambda tank: tank.send("levels", {"valu": 1.0}), "no field 'valu'; did you mean 'value'?"),
        (lambda tank: tank.send("levels", {"value": "1"}), "value takes a float64, not '1'"),
        (lambda tank: tank.send("levels", {"kind": 256}), "kind takes a uint8, not 256"),
        (lambda tank: tank.send("levels", {"codes": [1]}), "codes takes a int32[3], not [1]"),
        (lambda tank: tank.send("levels", {"codes": [1, 2, 3.0]}), "codes[2] takes a int32"),
        (lambda tank: tank.send("levels", 1.0), "'levels' takes a Level, not 1.0"),
        (lambda tank: tank.set_parameter("sizes", 1.0), "did you mean 'size'?"),
        (lambda tank: tank.set_parameter("size", -1.0), "less than the minimum of 0.0"),
        (lambda tank: tank.set_parameter("size", 0.7), "not a whole number of steps of 0.5"),
        (lambda tank: tank.set_parameter("size", "1"), "takes double, not the string '1'"),
        (lambda tank: tank.set_parameter("mode", "off"), "must be one of: slow, fast"),
        (lambda tank: tank.set_parameter("codes", [1]), "parameter 'codes' is read-only"),
        (lambda tank: tank.transition("start"), "there is no transition 'start'"),
        (lambda tank: tank.transition("configure"), "cannot configure the node: it is active"),
        (lambda tank: tank.run_until(lambda: False, 1.5), "not true within 1.5 s"),
        (lambda tank: tank.set_transform("map", "odom"), "the node has no 'transforms'"),
    ],
)
def test_a_wrong_test_fails_with_the_reason(
    tank_type: str, act: Callable[[BehaviorTest], None], reason: str
) -> None:
    with BehaviorTest(tank_type) as tank, pytest.raises(TestFailure) as failure:
        act(tank)
    assert reason in str(failure.value)


@pytest.mark.parametrize(
    ("name", "options", "reason"),
    [
        ("tanks", {}, "there is no node type 'tanks'; did you mean 'tank'?"),
        ("nodes/none.yaml", {}, "nodes/none.yaml has errors"),
        ("nodes/wrong.yaml", {}, "did you mean 'behavior'?"),
        ("plain", {}, "has no behavior (declarative node): test it with SystemTest"),
        ("systems/one.yaml", {}, "is a system: test it with SystemTest"),
        ("tank", {"parameters": {"rate": 1.0}}, "did you mean 'rate_hz'?"),
        ("tank", {"parameters": {"rate_hz": 0.0}}, "less than the minimum of 1.0 Hz"),
        ("tank", {"variables": {"dept": 1}}, "did you mean 'depth'?"),
    ],
)
def test_what_cannot_be_tested_is_refused(
    tank_type: str, name: str, options: dict[str, Any], reason: str
) -> None:
    with pytest.raises(TestFailure) as failure:
        BehaviorTest(name, **options)
    assert reason in str(failure.value)


def test_a_reported_failure_is_visible(tank_type: str) -> None:
    with BehaviorTest(tank_type) as tank:
        assert tank.failure is None
        tank.send("levels", {"kind": 3})
        assert (tank.failure, tank.state) == ("overflow", "active")
        assert tank.timeline()[-1] == "    0.000  the node has failed: overflow"


FAILING = """\
def test_levels(behavior_test):
    tank = behavior_test("nodes/tank.yaml")
    tank.advance(0.1)
    assert tank.state == "inactive"


def test_nothing():
    import sys
    assert "rclpy" not in sys.modules and "std_msgs" not in sys.modules
    assert any(name == "composer.loading" for name in sys.modules)
"""
WITHOUT_USE = (
    "import composer.testing.pytest_plugin, sys;"
    "print(*(name for name in sys.modules if name.startswith(('composer', 'rclpy', 'yaml'))))"
)


def test_the_plugin_shows_the_timeline_and_needs_no_ros(project: Path) -> None:
    (project / "test_tank.py").write_text(FAILING, encoding="utf-8")
    pytest_options = ("-q", "-p", "no:cacheprovider", "--rootdir=.", "test_tank.py")
    command = [sys.executable, "-m", "pytest", *pytest_options]
    ran = subprocess.run(command, cwd=project, capture_output=True, text=True, check=False)
    assert "1 failed, 1 passed" in ran.stdout, ran.stdout + ran.stderr
    _, _, timeline = ran.stdout.partition("- timeline of the last seconds -")
    assert "0.000  the node is active" in timeline
    assert "0.100  'tanks': Tank(level=Level(value=5.0" in timeline


def test_the_plugin_imports_nothing_unless_it_is_used() -> None:
    command = [sys.executable, "-c", WITHOUT_USE]
    ran = subprocess.run(command, capture_output=True, text=True, check=True)
    assert ran.stdout.split() == ["composer", "composer.testing", "composer.testing.pytest_plugin"]
