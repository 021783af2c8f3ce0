"""What a process of the composer loads of ROS, and when."""

from __future__ import annotations

import os
import subprocess
import sys

_LOAD = """
import os, sys
from composer.runtime.process.libraries import loading_libraries
with loading_libraries():
    pass
assert "rclpy" not in sys.modules
with open("/proc/self/maps") as maps:
    print("librcl.so" in maps.read())
"""
_TYPE_SUPPORT = """
import sys
from composer.runtime.ros.messages import interface_class
interface_class("std_msgs/msg/String")
print("lark" in sys.modules, "rosidl_generator_py" in sys.modules)
import rosidl_generator_py.generate_py_impl
"""


def _output(program: str, **environment: str) -> str:
    command = [sys.executable, "-c", program]
    return subprocess.run(
        command,
        env={**os.environ, **environment},
        stdout=subprocess.PIPE,
        text=True,
        timeout=60,
        check=True,
    ).stdout.strip()


def test_the_libraries_of_rclpy_are_loaded_before_it_is_imported() -> None:
    assert _output(_LOAD, RMW_IMPLEMENTATION="") == "True"


def test_with_a_selected_middleware_nothing_is_loaded_that_may_end_the_process() -> None:
    assert _output(_LOAD, RMW_IMPLEMENTATION="rmw_nothing") == "False"


def test_type_support_is_loaded_without_the_generator_of_message_classes() -> None:
    assert _output(_TYPE_SUPPORT) == "False True"
