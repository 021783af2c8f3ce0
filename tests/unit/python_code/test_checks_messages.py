"""Values of message fields, and constants that they are compared with."""

from __future__ import annotations

import textwrap
from pathlib import Path

import pytest

from tests.unit.support.python_checks import check, problems

IMPORTS = """
import geometry_msgs.msg
from composer.behavior import Behavior
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from action_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState, Imu, NavSatFix, NavSatStatus, Range
from shape_msgs.msg import SolidPrimitive
from std_msgs.msg import Header, Int8, String, UInt8, UInt8MultiArray
from std_srvs.srv import Trigger
from visualization_msgs.msg import Marker

LIMIT = 300
"""
WRONG = [
    "UInt8(data=300)  # VALUE",
    "UInt8(data=-1)  # VALUE",
    "UInt8(data=LIMIT)  # VALUE",
    "message = Int8()\nmessage.data = 128  # VALUE",
    "message = UInt8MultiArray(data=[1, 256])  # VALUE",
    "message = UInt8MultiArray()\nmessage.data = [256, 300]  # VALUE",
    "message = UInt8MultiArray()\nmessage.data[0] = 256  # VALUE",
    "UInt8MultiArray(data=[3 if x else -1 for x in range(3)])  # VALUE",
    "UInt8(data='3')  # VALUE",
    "UInt8(data=3.0)  # VALUE",
    "String(data=3)  # VALUE",
    "Imu(orientation_covariance=[1, 0, 0, 0, 1])  # VALUE",
    "Imu(orientation_covariance=[0.0] * 8)  # VALUE",
    "Imu(orientation_covariance=[0.0, 1.0])  # VALUE",
    "SolidPrimitive(dimensions=[1.0, 2.0, 3.0, 4.0])  # VALUE",
    "Header(frame_id='/map')  # FRAME",
    "pose = PoseStamped()\npose.header.frame_id = '/map'  # FRAME",
    "odometry = Odometry(child_frame_id='/base')  # FRAME",
    "pose = geometry_msgs.msg.PoseStamped()\npose.header.frame_id = '/map'  # FRAME",
    "BatteryState(power_supply_status=9)  # VALUE?",
    "battery = BatteryState()\nif battery.power_supply_status == 12:  # VALUE?\n    pass",
    "battery = BatteryState()\nif battery.power_supply_status in (1, 12):  # VALUE?\n    pass",
    "Range(radiation_type=4)  # VALUE?",
]
RIGHT = [
    "UInt8(data=255)",
    "UInt8(data=self.parameters.limit)",
    "limit = 300\nlimit = 3\nUInt8(data=limit)",
    "limit = 300\nlimit -= 100\nUInt8(data=limit)",
    "message = UInt8MultiArray(data=[1, 255])",
    "message = UInt8MultiArray(data=b'ab')",
    "message = UInt8MultiArray()\nmessage.data = list(range(300))",
    "Imu(orientation_covariance=[0.0] * 9)",
    "Imu(orientation_covariance=[*range(3), *range(6)])",
    "Imu(orientation_covariance=[float(x) for x in range(9)])",
    "SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[1.0, 2.0, 3.0])",
    "SolidPrimitive(dimensions=[])",
    "Header(frame_id='map')",
    "Header(frame_id=self.parameters.frame)",
    "String(data='/map')",
    "odom.twist.covariance = odom.pose.covariance",
    "status = DiagnosticStatus(level=b'\\x00')\nstatus.name = str(3)",
    "Trigger.Response(success=1)",
    "status = DiagnosticStatus()\nstatus.level = DiagnosticStatus.ERROR",
    "status = DiagnosticStatus(level=b'\\x02')\nif status.level == b'\\x02':\n    pass",
    "battery = BatteryState()\nbattery.power_supply_status = BatteryState.POWER_SUPPLY_STATUS_FULL",
    "battery = BatteryState()\nbattery.voltage = 24.0\nif battery.percentage == 0:\n    pass",
    "fix = NavSatFix()\nfix.status.service = NavSatStatus.SERVICE_GPS",
    "NavSatStatus(service=3)",  # a combination of flags
    "status = GoalStatus()\nstatus.status = GoalStatus.STATUS_ABORTED",
    "Marker(type=Marker.CUBE, action=Marker.ADD)",
    "marker = Marker()\nmarker.action = 3\nmarker.id = 300",
    "twist = Twist()\ntwist.linear.x = 1.0\ntwist.nothing = 5000",
    "Twist = str\nTwist(data=3)",
    "response = Trigger.Response(success=True, message='done')",
    "if odom.header.frame_id == '/map':\n    pass",
    "value = [0.0]\nvalue.append(1)\nImu(orientation_covariance=value)",
]


def behavior(body: str) -> str:
    head = "class Robot(Behavior):\n    def on_odometry(self, odom):\n"
    return IMPORTS + head + textwrap.indent(body, "        ") + "\n"


FILES = [
    # Arguments with annotations.
    """
    from sensor_msgs.msg import BatteryState, NavSatStatus

    class Robot:
        def on_tick(self):
            self.show(BatteryState())
        def show(self, battery: BatteryState):
            battery.power_supply_status = 9  # VALUE?

    def show(status: NavSatStatus):
        status.service = 70000  # VALUE

    def unknown(status: NavSatStatus | None):
        status.service = 70000
    """,
    # Statements outside of functions.
    """
    from std_msgs.msg import UInt8

    ZERO = UInt8(data=256)  # VALUE

    class Robot:
        FULL = UInt8(data=-1)  # VALUE
        def on_tick(self):
            UInt8 = dict
            return UInt8(data=300)
    """,
    """
    from sensor_msgs.msg import BatteryState

    class Robot:
        def on_battery(self, message):
            if message.power_supply_health == 40:  # VALUE?
                return
            if message.power_supply_status == BatteryState.POWER_SUPPLY_STATUS_FULL:
                return
    """,
]


@pytest.mark.parametrize("text", [*map(behavior, WRONG + RIGHT), *FILES])
def test_values(text: str, tmp_path: Path) -> None:
    check(text, tmp_path, "behavior")


def test_texts(tmp_path: Path) -> None:
    body = "BatteryState(power_supply_status=9)\nImu(orientation_covariance=[1.0])\nUInt8(data=-1)"
    found = problems(behavior(body), tmp_path, "behavior")
    no_constant = "sensor_msgs/msg/BatteryState has no constant for 'power_supply_status'"
    assert [(item.message, item.span.text) for item in found] == [
        (f"{no_constant} with the value 9", "9"),
        ("1 element where float64[9] is expected", "[1.0]"),
        ("-1 is outside the range of uint8", "-1"),
    ]
    assert str(found[0].hint).startswith("valid here: 0 POWER_SUPPLY_STATUS_UNKNOWN, 1 ")
