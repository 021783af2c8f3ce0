"""``transforms`` and ``self.transforms``, with hand-written nodes on /tf and /tf_static."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PointStamped, PoseStamped, Transform, TransformStamped, Vector3Stamped
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock

from tests.ros.support.in_process import Peer, RunningSystem, running, wait_until

if os.environ.get("CI") != "true":
    pytest.importorskip("tf2_msgs", reason="make test builds it")
from tf2_msgs.msg import TFMessage

#: As tf2_ros publishes and subscribes.
DYNAMIC = QoSProfile(depth=100)
STATIC = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

LOOKUP = """
from composer.behavior import Behavior, TransformError

class Tracker(Behavior):
    timeout_ms = 20000

    def on_configure(self):
        self.asked, self.found, self.errors = [], [], []

    async def on_activate(self):
        self.available = self.transforms.can_lookup("map", "laser")

    async def on_target(self, message):
        self.asked.append(message)
        try:
            header, timeout_ms = message.header, self.timeout_ms
            found = await self.transforms.wait(
                "map", header.frame_id, stamp=header.stamp, timeout_ms=timeout_ms
            )
            self.found.append(found)
        except TransformError as error:
            self.errors.append(f"{type(error).__name__}: {error}")

    def on_now(self, message):
        try:
            self.found.append(self.transforms.lookup("map", message.header.frame_id))
        except Exception as error:
            self.errors.append(f"{type(error).__name__}: {error}")
"""
LISTENER = """
system: listener
nodes:
  tracker:
    behavior: tracker:Tracker
    lifecycle: {autostart: inactive}
    subscriptions:
      target: {type: geometry_msgs/msg/TransformStamped, qos: command, external: true}
      now: {type: geometry_msgs/msg/TransformStamped, qos: command, external: true}
    transforms: {lookup: [map, laser]}
"""


def transform(parent: str, child: str, stamp_s: float, x: float) -> TransformStamped:
    message = TransformStamped()
    message.header.frame_id, message.child_frame_id = parent, child
    message.header.stamp = time(stamp_s)
    message.transform.translation.x = x
    return message


def time(stamp_s: float) -> Time:
    whole = int(stamp_s)
    return Time(sec=whole, nanosec=round((stamp_s - whole) * 1e9))


def asked(frame: str, stamp_s: float = 0.0) -> TransformStamped:
    message = TransformStamped()
    message.header.frame_id, message.header.stamp = frame, time(stamp_s)
    return message


def x_of(found: TransformStamped) -> float:
    return float(found.transform.translation.x)


def test_a_behavior_looks_up_what_other_nodes_broadcast(tmp_path: Path, peer: Peer) -> None:
    static = peer.node.create_publisher(TFMessage, "/tf_static", STATIC)
    static.publish(TFMessage(transforms=[transform("base_link", "laser", 0.0, 0.5)]))
    dynamic = peer.node.create_publisher(TFMessage, "/tf", DYNAMIC)
    with running(LISTENER, tmp_path, tracker=LOOKUP) as system:
        tracker = system.behavior("tracker")
        assert dynamic.get_subscription_count() == 0  # nothing flows while it is not active
        with pytest.raises(Exception, match="/tracker is inactive, not active"):
            tracker.transforms.lookup("map", "laser")
        assert not tracker.transforms.can_lookup("map", "laser")
        system.change("tracker", "activate")
        assert tracker.available is False
        wait_until(dynamic.get_subscription_count, "a subscription of /tf")
        wait_until(lambda: tracker.transforms.can_lookup("base_link", "laser"), "/tf_static")
        target = peer.publisher(TransformStamped, "/target")
        now = peer.publisher(TransformStamped, "/now")

        # The transform for a message arrives after it, as it usually does.
        target.publish(asked("laser", 11.5))
        wait_until(lambda: tracker.asked, "the behavior to wait")
        for stamp_s, x in ((10.0, 1.0), (11.0, 2.0), (12.0, 4.0)):
            moved = transform("map", "base_link", stamp_s, x)
            dynamic.publish(TFMessage(transforms=[moved]))
        wait_until(lambda: tracker.found, "a transform")
        assert x_of(tracker.found[0]) == pytest.approx(3.5)
        assert tracker.found[0].header.frame_id == "map"
        assert tracker.found[0].child_frame_id == "laser"
        assert tracker.found[0].header.stamp == time(11.5)

        now.publish(asked("laser"))
        wait_until(lambda: len(tracker.found) == 2, "the latest transform")
        assert x_of(tracker.found[1]) == pytest.approx(4.5)
        assert tracker.found[1].header.stamp == time(12.0)

        tracker.timeout_ms = 100
        target.publish(asked("laser", 13.0))
        wait_until(lambda: tracker.errors, "an error")
        assert "known from 10.000 s to 12.000 s, and the time is later" in tracker.errors[0]
        assert tracker.errors[0].startswith("TransformExtrapolationError")
        assert tracker.errors[0].endswith("(after 100 ms)")
        now.publish(asked("lasr"))
        wait_until(lambda: len(tracker.errors) == 2, "an error")
        assert "frame 'lasr' is not known; did you mean 'laser'?" in tracker.errors[1]

        bad = transform("map", "other", 12.0, math.nan)
        dynamic.publish(TFMessage(transforms=[bad]))
        assert "ignored the transform from 'other' to 'map'" in system.wait_for_log("not finite")

        system.change("tracker", "deactivate")
        wait_until(lambda: not dynamic.get_subscription_count(), "no subscription of /tf")
        system.change("tracker", "cleanup", "configure", "activate")
        again = system.behavior("tracker")
        wait_until(lambda: again.transforms.can_lookup("base_link", "laser"), "/tf_static")
        assert not again.transforms.can_lookup("map", "base_link")  # the buffer is a new one
        counted = system.summary("/tracker")
    assert counted.errors == 0


BROADCAST = """
from composer.behavior import Behavior
from geometry_msgs.msg import Transform

class Arm(Behavior):
    def on_activate(self):
        turned = Transform()
        turned.rotation.z, turned.rotation.w = 0.6, 0.8
        self.transforms.broadcast("wrist", turned)

    def on_tick(self):
        self.transforms.broadcast("gripper", Transform())

    def refused(self, child, transform=None):
        try:
            self.transforms.broadcast(child, transform or Transform())
        except ValueError as error:
            return str(error)
"""
BROADCASTER = """
system: broadcaster
nodes:
  arm:
    behavior: arm:Arm
    lifecycle: {autostart: inactive}
    timers: {tick: {period_ms: 5}}
    transforms:
      static:
        base: {parent: world, translation_m: {x: 0.25, z: 1}, rotation_deg: {yaw: 90}}
        wrist: {parent: base, from_code: true}
        plate: {parent: base}
      dynamic: {gripper: {parent: wrist}}
  localization:
    lifecycle: {autostart: inactive}
    subscriptions:
      odometry: {type: nav_msgs/msg/Odometry, qos: command, external: true, log: got}
    transforms: {dynamic: {base_link: {parent: odom, from: odometry}}}
"""


def test_nodes_broadcast_while_they_are_active(tmp_path: Path, peer: Peer) -> None:
    with running(BROADCASTER, tmp_path, arm=BROADCAST) as system:
        dynamic, static = (
            peer.listen(TFMessage, "/tf", DYNAMIC),
            peer.listen(TFMessage, "/tf_static", STATIC),
        )
        arm = system.behavior("arm")
        arm.on_tick()
        assert (dynamic, static) == ([], [])
        system.change("arm", "activate")
        wait_until(lambda: static and len(static[-1].transforms) == 3, "static transforms")
        frames = {item.child_frame_id: item for item in static[-1].transforms}
        base, plate, wrist = frames["base"], frames["plate"], frames["wrist"]
        assert (base.header.frame_id, base.child_frame_id) == ("world", "base")
        assert (base.transform.translation.x, base.transform.translation.z) == (0.25, 1.0)
        assert base.transform.rotation.w == pytest.approx(math.sqrt(0.5))
        assert plate.transform == Transform()  # the identity
        assert (wrist.child_frame_id, wrist.transform.rotation.z) == ("wrist", 0.6)
        wait_until(lambda: dynamic, "a transform on /tf")
        (gripper,) = dynamic[0].transforms
        assert (gripper.header.frame_id, gripper.child_frame_id) == ("wrist", "gripper")
        assert gripper.header.stamp.sec > 0
        late = peer.join("late")  # a late joiner gets the static transforms
        latched: list[Any] = []
        late.create_subscription(TFMessage, "/tf_static", latched.append, STATIC)
        wait_until(lambda: latched, "latched transforms")
        assert len(latched[0].transforms) == 3
        assert "'grip' is not declared in 'transforms'" in arm.refused("grip")
        zero = TransformStamped().transform
        zero.rotation.w = 0.0
        assert arm.refused("gripper", zero) == "the rotation is not a unit quaternion"
        assert arm.refused("gripper", 1.0) == "expected a geometry_msgs/msg/Transform, got float"
        system.change("arm", "deactivate")
        node = system.node("arm")
        sent, dropped = node.sent("/tf"), node.statistics.dropped
        arm.on_tick()
        assert (node.sent("/tf"), node.statistics.dropped) == (sent, dropped + 1)
        check_odometry(system, peer, dynamic)
        system.change("arm", "cleanup")
        system.change("localization", "deactivate", "cleanup")
        wait_until(lambda: not peer.node.count_publishers("/tf"), "no publisher of /tf")


def check_odometry(system: RunningSystem, peer: Peer, dynamic: list[Any]) -> None:
    system.change("localization", "activate")
    odometry = peer.publisher(Odometry, "/odometry")
    message = Odometry()
    message.header.stamp = time(7.5)
    message.pose.pose.position.y = 2.0
    odometry.publish(message)

    def received() -> list[Any]:
        moved = (item.transforms[0] for item in dynamic)
        return [item for item in moved if item.child_frame_id == "base_link"]

    wait_until(received, "the transform of the odometry")
    (moved,) = received()
    assert (moved.header.frame_id, moved.header.stamp) == ("odom", time(7.5))
    assert moved.transform.translation.y == 2.0
    system.wait_for_log("got")
    message.pose.pose.orientation.w = 0.0
    odometry.publish(message)
    text = "frame 'base_link' is not broadcast: the rotation is not a unit quaternion"
    system.wait_for_log(text)


SHARED = """
system: shared
nodes:
  source:
    behavior: source:Source
    timers: {tick: {period_ms: 5}}
    transforms:
      static: {laser: {parent: base_link, translation_m: {x: 0.5}}}
      dynamic: {base_link: {parent: map}}
      lookup: [map, laser]
  other:
    behavior: source:Other
    lifecycle: {autostart: inactive}
    transforms: {lookup: [map, laser]}
  apart:
    behavior: source:Other
    remappings: {/tf: /arm/tf, /tf_static: /arm/tf_static}
    transforms: {lookup: []}
"""
SOURCE = """
from composer.behavior import Behavior, TransitionFailed
from geometry_msgs.msg import Transform

class Source(Behavior):
    def on_tick(self):
        self.transforms.broadcast("base_link", Transform())

class Other(Behavior):
    refuses = False

    def on_deactivate(self):
        if self.refuses:
            raise TransitionFailed("not now")
"""


def test_nodes_of_a_process_share_one_buffer(tmp_path: Path, peer: Peer) -> None:
    with running(SHARED, tmp_path, source=SOURCE) as system:
        source, other = system.behavior("source"), system.behavior("other")
        wait_until(lambda: source.transforms.can_lookup("map", "laser"), "a transform")
        system.change("other", "activate")
        assert x_of(other.transforms.lookup("map", "laser")) == 0.5
        assert not system.behavior("apart").transforms.can_lookup("map", "laser")

        def subscriptions(topic: str) -> int:
            return int(peer.node.count_subscribers(topic))

        for topic in ("/tf", "/arm/tf", "/tf_static"):
            wait_until(lambda topic=topic: subscriptions(topic) == 1, f"one on {topic}")
        # In the process, transforms do not go through DDS.
        publisher: Any = next(iter(source.transforms.broadcaster.publishers)).gated
        assert type(publisher).__name__ == "LatchingPublisher"
        system.change("source", "deactivate")
        assert other.transforms.can_lookup("map", "laser")  # it is still filled for this node
        check_messages(other)
        other.refuses = True
        assert not peer.change("/other", "deactivate")
        wait_until(lambda: other.transforms.can_lookup("base_link", "laser"), "/tf_static")
        other.refuses = False
        system.change("other", "deactivate")
        wait_until(lambda: subscriptions("/tf") == 0, "no subscription")


def check_messages(other: Any) -> None:
    """Stamped messages of geometry_msgs are transformed; ``laser`` is half a meter in front."""
    point = PointStamped()
    point.header.frame_id, point.point.y = "laser", 1.0
    moved = other.transforms.transform(point, "map")
    assert (moved.header.frame_id, moved.point.x, moved.point.y) == ("map", 0.5, 1.0)
    vector = Vector3Stamped()
    vector.header.frame_id, vector.vector.y = "laser", 1.0
    assert other.transforms.transform(vector, "map").vector == vector.vector
    pose = PoseStamped()
    pose.header.frame_id, pose.pose.orientation.z, pose.pose.orientation.w = "laser", 1.0, 0.0
    moved = other.transforms.transform(pose, "map").pose
    assert (moved.position.x, moved.orientation) == (0.5, pose.pose.orientation)
    with pytest.raises(TypeError, match="stamp must be a builtin_interfaces/msg/Time, not float"):
        other.transforms.lookup("map", "laser", stamp=1.0)
    with pytest.raises(TypeError, match="cannot transform Odometry; transform one of PointStamped"):
        other.transforms.transform(Odometry(header=point.header), "map")
    for wrong in ({"target": ["lasr"]}, {"target": "lasr", "timeout_ms": "soon"}):
        with pytest.raises(TypeError):
            other.transforms.wait(source="laser", **wrong)


def test_the_buffer_is_emptied_when_simulated_time_goes_back(tmp_path: Path, peer: Peer) -> None:
    text = LISTENER.replace("system: listener", "system: listener\nuse_sim_time: true")
    with running(text, tmp_path, tracker=LOOKUP) as system:
        system.change("tracker", "activate")
        transforms = system.behavior("tracker").transforms
        dynamic = peer.publisher(TFMessage, "/tf", DYNAMIC)
        clock = peer.publisher(Clock, "/clock")

        def moves_to(stamp_s: float, condition: Callable[[], bool]) -> None:
            def publish() -> bool:
                clock.publish(Clock(clock=time(stamp_s)))
                return condition()

            wait_until(publish, f"{stamp_s} s")

        node = system.node("tracker")
        moves_to(100.0, lambda: node.now_s() == 100.0)
        dynamic.publish(TFMessage(transforms=[transform("map", "laser", 100.0, 1.0)]))
        wait_until(lambda: transforms.can_lookup("map", "laser"), "a transform")
        moves_to(101.0, lambda: node.now_s() == 101.0)
        assert transforms.can_lookup("map", "laser")
        moves_to(50.0, lambda: not transforms.can_lookup("map", "laser"))
        dynamic.publish(TFMessage(transforms=[transform("map", "laser", 50.0, 2.0)]))
        wait_until(lambda: transforms.can_lookup("map", "laser"), "a transform")
        assert x_of(transforms.lookup("map", "laser")) == 2.0
