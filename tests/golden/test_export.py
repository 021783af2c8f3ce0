"""What ``compose export`` writes for service managers and container engines, in ``export/``."""

from __future__ import annotations

from pathlib import Path, PurePosixPath

import pytest

from composer.bridges.export.container_image import Contents, containerfile
from composer.bridges.export.deployment import Service
from composer.bridges.export.docker_compose import compose_file
from composer.bridges.export.kubernetes import manifests
from composer.bridges.export.systemd import Installation, units
from composer.client.hosts.remote_command import python_words
from composer.loading import load
from composer.model import Host

EXPECTED = Path(__file__).parent / "export"
ENVIRONMENT = {"ROS_DOMAIN_ID": "7", "PYTHONPATH": "/opt/my libraries", "HOME": "/nowhere"}


def exported() -> dict[str, str]:
    """Return the files by their names."""
    path = EXPECTED / "robot.yaml"
    system = load(path).system
    assert system is not None
    contents = Contents(
        "my_robot",
        PurePosixPath("systems/my robot.yaml"),
        has_requirements=True,
        interfaces=("tf2_msgs", "my_msgs"),
    )
    wheel = PurePosixPath("deploy/ros2_composer-0.1.0-py3-none-any.whl")
    image = "registry.local:5000/robot:1.2"
    build = {"context": "..", "dockerfile": "deploy/Containerfile"}

    def remote(host: Host, service: Service) -> list[str]:
        words = ("-m", "composer", *service.command("systems/robot.yaml"))
        return python_words(host, words, ENVIRONMENT)

    installation = Installation(("/opt/ros/python", "-P"), ENVIRONMENT, remote)
    services = units(system, path, installation, user=False)
    texts = {
        "compose.yaml": compose_file(system, contents, image, build, ENVIRONMENT),
        "kubernetes.yaml": manifests(system, contents, image, ENVIRONMENT),
        "Containerfile": containerfile(contents, wheel),
    }
    texts |= {str(name): text for name, text in services.items()}
    return {name: text.replace(str(EXPECTED), "/project") for name, text in texts.items()}


def test_files(request: pytest.FixtureRequest) -> None:
    texts = exported()
    if request.config.getoption("--update-golden"):
        for name, text in texts.items():
            (EXPECTED / name).parent.mkdir(exist_ok=True)
            (EXPECTED / name).write_text(text, encoding="utf-8")
    found = {
        path.relative_to(EXPECTED).as_posix(): path.read_text(encoding="utf-8")
        for path in sorted(EXPECTED.rglob("*"))
        if path.is_file() and path.name != "robot.yaml"
    }
    assert texts == found
    assert exported() == texts
