"""Log levels are set at run time by the standard services, as for rclpy's nodes."""

from __future__ import annotations

from pathlib import Path

from rcl_interfaces.msg import LoggerLevel
from rcl_interfaces.srv import GetLoggerLevels, SetLoggerLevels

from composer.runtime.supervision.events import Logged
from tests.ros.support.in_process import Peer, RunningSystem, running, wait_until

SYSTEM = """
system: logged
namespace: /a
nodes:
  plain: {behavior: code:Plain, log_level: warn}
  hosted: {class: "code:Hosted"}
  served: {behavior: code:Plain, introspection: {logger_services: true}}
  enabled: {class: "code:Enabled"}
  both: {class: "code:Enabled", introspection: {logger_services: true}}
"""
CODE = """
from composer.behavior import Behavior
from rclpy.node import Node
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn

class Plain(Behavior):
    def on_configure(self):
        self.log.debug("configured")
        self.log.info("info")

class Hosted(LifecycleNode):
    def __init__(self):
        super().__init__("hosted")

    def on_configure(self, state):
        self.get_logger().debug("configured")
        self.get_logger().get_child("child").debug("child configured")
        return TransitionCallbackReturn.SUCCESS

class Enabled(Node):
    def __init__(self):
        super().__init__("enabled", enable_logger_service=True)
"""
MANAGER = "/a/logged/manager"


def logged(system: RunningSystem, logger: str) -> list[str]:
    return [item.message for item in system.reported(Logged) if item.logger == logger]


def services(peer: Peer) -> set[str]:
    found = dict(peer.node.get_service_names_and_types())
    return {name for name in found if name.endswith("/set_logger_levels")}


def set_levels(peer: Peer, node: str, **levels: int) -> list[tuple[bool, str]]:
    items = [LoggerLevel(name=f"a.{name}", level=level) for name, level in levels.items()]
    answer = peer.call(
        SetLoggerLevels, f"{node}/set_logger_levels", SetLoggerLevels.Request(levels=items)
    )
    return [(item.successful, item.reason) for item in answer.results]


def levels(peer: Peer, node: str, *names: str) -> list[tuple[str, int]]:
    request = GetLoggerLevels.Request(names=list(names))
    answer = peer.call(GetLoggerLevels, f"{node}/get_logger_levels", request)
    return [(item.name, item.level) for item in answer.levels]


def test_levels_follow_the_services_which_refuse_huge_requests(tmp_path: Path, peer: Peer) -> None:
    names = [f"a.{name}" for name in ("plain", "hosted", "served", "other")]
    with running(SYSTEM, tmp_path, code=CODE) as system:
        for node in (MANAGER, "/a/served"):
            found = levels(peer, node, *names)
            assert found == list(zip(names, (30, 20, 20, 0), strict=True))
        nodes = (MANAGER, "/a/served", "/a/enabled", "/a/both")
        wait_until(lambda: services(peer) == {f"{node}/set_logger_levels" for node in nodes})
        refusal = "'get_logger_levels': 10001 names in one request, at most 10000"
        for number, node in enumerate(nodes, 1):
            assert levels(peer, node, *["x"] * 10_001) == []
            wait_until(lambda n=number: system.log_text().count(refusal) == n, "the refusal")
        assert set_levels(peer, MANAGER, plain=10, hosted=10, served=25) == [
            (True, ""),
            (True, ""),
            (False, "25 is not a valid LoggingSeverity"),
        ]
        assert set_levels(peer, "/a/served", served=40) == [(True, "")]
        assert "configured" not in logged(system, "a.hosted") + logged(system, "a.plain")
        for name in ("plain", "hosted", "served"):
            # also while unconfigured, and the level stays
            system.change(name, "deactivate", "cleanup", "configure")
        assert logged(system, "a.plain") == ["configured", "info"]
        assert logged(system, "a.hosted") == ["configured"]
        assert logged(system, "a.hosted.child") == ["child configured"]
        info, refused = logged(system, "a.served")
        assert info == "info"
        assert refusal in refused
        assert levels(peer, MANAGER, *names[:3]) == [(names[0], 10), (names[1], 10), (names[2], 40)]
