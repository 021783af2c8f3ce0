"""Errors in the environment are reported before ROS reads it."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.runtime.middleware.environment import (
    check_environment,
    complete_environment,
    log_folder,
)
from composer.runtime.process import StartRefused

SECURE = {
    "ROS_SECURITY_ENABLE": "true",
    "ROS_SECURITY_KEYSTORE": "keys",
    "ROS_SECURITY_STRATEGY": "Enforce",
}


@pytest.mark.parametrize(
    "environment",
    [
        {},
        {"ROS_DOMAIN_ID": ""},
        {"ROS_DOMAIN_ID": "0"},
        {"ROS_DOMAIN_ID": "232", "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"},
        {"ROS_SECURITY_ENABLE": "false"},
        {"ROS_SECURITY_ENABLE": "False"},
        {"ROS_SECURITY_ENABLE": "0"},
        SECURE,
        {"RMW_IMPLEMENTATION": "rmw_anything"},  # without a prefix, it cannot be checked
    ],
)
def test_a_valid_environment_is_accepted(environment: dict[str, str]) -> None:
    check_environment(environment)


@pytest.mark.parametrize(
    ("environment", "message", "hint"),
    [
        *(
            ({"ROS_DOMAIN_ID": text}, f"ROS_DOMAIN_ID is '{text}'", "from 0 to 232")
            for text in ("-1", "x", "233", "\N{SUPERSCRIPT TWO}")
        ),
        *(
            ({"ROS_AUTOMATIC_DISCOVERY_RANGE": text}, "is not a discovery range", hint)
            for text, hint in (
                ("LOCALHOTS", "did you mean LOCALHOST?"),
                ("BOGUS", "valid values: SUBNET"),
            )
        ),
        ({"ROS_SECURITY_ENABLE": "true"}, "ROS_SECURITY_KEYSTORE is not set", "create_keystore"),
        *(
            (
                {**SECURE, "ROS_SECURITY_ENABLE": text},
                f"is '{text}', but",
                "set ROS_SECURITY_ENABLE=",
            )
            for text in ("True", "TRUE", "1", "yes", "true ")
        ),
        (
            {**SECURE, "ROS_SECURITY_STRATEGY": "Permissive"},
            "would run unsecured",
            "ROS_SECURITY_STRATEGY=Enforce",
        ),
    ],
)
def test_invalid_values_are_refused(environment: dict[str, str], message: str, hint: str) -> None:
    with pytest.raises(StartRefused) as refusal:
        check_environment(environment)
    assert message in str(refusal.value)
    assert hint in refusal.value.hint


def test_the_folder_for_logs_is_that_of_ros() -> None:
    home = {"HOME": "/home/me"}
    assert log_folder({}) is None
    assert log_folder(home) == Path("/home/me/.ros/log")
    assert log_folder({**home, "ROS_HOME": "/ros"}) == Path("/ros/log")
    assert log_folder({**home, "ROS_HOME": "/ros", "ROS_LOG_DIR": "/logs"}) == Path("/logs")


def test_a_middleware_that_is_not_installed_is_refused(tmp_path: Path) -> None:
    index = tmp_path / "share" / "ament_index" / "resource_index" / "rmw_typesupport"
    index.mkdir(parents=True)
    (index / "rmw_fastrtps_cpp").touch()
    (index / "rmw_implementation").touch()
    environment = {"AMENT_PREFIX_PATH": f"/nowhere:{tmp_path}"}
    check_environment({**environment, "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp"})
    with pytest.raises(StartRefused) as refusal:
        check_environment({**environment, "RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"})
    assert refusal.value.hint == "installed: rmw_fastrtps_cpp"


def test_variables_that_are_set_are_kept() -> None:
    given = {"AMENT_PREFIX_PATH": "/opt/ros/jazzy", "ROS_DISTRO": "kilted"}
    given |= {"RCUTILS_CONSOLE_OUTPUT_FORMAT": "x"}
    environment = dict(given)
    complete_environment(environment)
    assert environment == given | {"ROS_VERSION": "2", "ROS_PYTHON_VERSION": "3"}
    complete_environment(environment := {})
    assert environment["ROS_DISTRO"] == "jazzy"
