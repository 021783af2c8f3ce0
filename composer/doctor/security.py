"""Whether the middleware can enforce the policies of SROS2: a child process tries it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from composer.doctor.result import CheckResult, note, ok, warning

AREA = "security"
#: The files of an enclave. Empty ones are enough: a middleware with security reads them and refuses
#: them, one without it fails first.
_FILES = (
    "cert.pem",
    "governance.p7s",
    "identity_ca.cert.pem",
    "key.pem",
    "permissions.p7s",
    "permissions_ca.cert.pem",
)
_PROGRAM = """
import rclpy
rclpy.init(args=["--ros-args", "--enclave", "/"])
try:
    rclpy.create_node("_compose_doctor_security")
except Exception as error:
    print(error)
else:
    print("STARTED")
"""
_STARTED = "STARTED"
#: What rmw_fastrtps says if Fast DDS was built without security.
_NOT_BUILT = "security libraries"
_WITHIN_S = 20.0


def check_security(environment: Mapping[str, str]) -> CheckResult:
    """Start a secured node with an enclave that is not valid, which has to fail."""
    output = _try(environment)
    if output is None:
        return note(AREA, "not checked: a secured node did not start or fail in time", "try again")
    if _NOT_BUILT in output:
        return note(
            AREA,
            "this build of Fast DDS has no security: it cannot enforce policies of SROS2"
            " ('compose export sros2')",
            "use one that has, such as that of ROS 2 Jazzy from packages.ros.org",
        )
    if _STARTED in output:
        return warning(
            AREA,
            "the middleware ignores security: a secured node started without valid keys",
            "use rmw_fastrtps_cpp or rmw_cyclonedds_cpp, built with security",
        )
    return ok(
        AREA, "the middleware refuses nodes without valid keys: it can enforce SROS2 policies"
    )


def _try(environment: Mapping[str, str]) -> str | None:
    """Return what a secured node prints; None if it takes too long."""
    with TemporaryDirectory(prefix="compose-") as folder:
        enclaves = Path(folder, "enclaves")
        enclaves.mkdir()
        for name in _FILES:
            (enclaves / name).touch()
        secured = {
            "ROS_SECURITY_ENABLE": "true",
            "ROS_SECURITY_STRATEGY": "Enforce",
            "ROS_SECURITY_KEYSTORE": folder,
            "ROS_LOG_DIR": folder,
        }
        try:
            done = subprocess.run(  # noqa: S603 - this very Python
                [sys.executable, "-P", "-c", _PROGRAM],
                check=False,
                capture_output=True,
                text=True,
                errors="replace",
                timeout=_WITHIN_S,
                env={**os.environ, **environment, **secured},
            )
        except (subprocess.TimeoutExpired, OSError):
            return None
    return done.stdout + done.stderr
