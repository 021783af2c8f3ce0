"""What ``compose export`` writes, in ``export/``, and whether those who read it accept it."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path, PurePosixPath

import pytest
import yaml

from composer.bridges.export.container_image import Contents, compose_file, containerfile
from composer.bridges.export.deployment import Service
from composer.bridges.export.kubernetes import manifests
from composer.bridges.export.sros2 import policy
from composer.bridges.export.systemd import Installation, units
from composer.client.hosts.remote_command import python_words
from composer.loading import load_models
from composer.model import Host
from tests.programs import require, require_module

EXPECTED = Path(__file__).parent / "export"
#: Of SROS2; see THIRD_PARTY.md.
SCHEMAS = Path(__file__).parents[1] / "unit" / "bridges" / "export" / "sros2"
SYSTEMS = sorted(path.parent.name for path in EXPECTED.glob("*/system.yaml"))
ENVIRONMENT = {"ROS_DOMAIN_ID": "7", "PYTHONPATH": "/opt/my libraries", "HOME": "/nowhere"}
NEEDS = {"has_requirements": True, "interfaces": ("tf2_msgs", "my_msgs")}
LACKS = {"unknown_interfaces": ("acme_msgs", "lab_msgs")}


def exported(name: str) -> dict[str, str]:
    """Return the files of a system by their names."""
    path = EXPECTED / name / "system.yaml"
    system = load_models([path])[0].system
    assert system is not None
    needs = NEEDS if name == "robot" else LACKS if name == "outside" else {}
    contents = Contents("my_robot", PurePosixPath("systems/my robot.yaml"), **needs)  # type: ignore[arg-type]
    wheel = PurePosixPath("deploy/ros2_composer-0.1.0-py3-none-any.whl")
    image = "registry.local:5000/robot:1.2"
    build = {"context": "..", "dockerfile": "deploy/Containerfile"}

    def remote(host: Host, service: Service) -> list[str]:
        words = ("-m", "composer", *service.command("systems/robot.yaml"))
        return python_words(host, words, ENVIRONMENT)

    installation = Installation(("/opt/ros/python", "-P"), ENVIRONMENT, remote)
    services = units(system, path, installation, user=name == "shutdown")
    texts = {
        "compose.yaml": compose_file(system, contents, image, build, ENVIRONMENT),
        "kubernetes.yaml": manifests(system, contents, image, ENVIRONMENT),
        "Containerfile": containerfile(contents, wheel),
        "policy.xml": policy(system),
    }
    texts |= {str(name): text for name, text in services.items()}
    return {file: text.replace(str(EXPECTED / name), "/project") for file, text in texts.items()}


@pytest.mark.parametrize("name", SYSTEMS)
def test_files(name: str, request: pytest.FixtureRequest) -> None:
    texts = exported(name)
    if request.config.getoption("--update-golden"):
        for file, text in texts.items():
            (EXPECTED / name / file).parent.mkdir(exist_ok=True, parents=True)
            (EXPECTED / name / file).write_text(text, encoding="utf-8")
    assert texts == {
        str(path.relative_to(EXPECTED / name)): path.read_text() for path in files(name)
    }
    assert exported(name) == texts


def files(name: str, pattern: str = "*") -> list[Path]:
    paths = (EXPECTED / name).rglob(pattern)
    return sorted(path for path in paths if path.is_file() and path.name != "system.yaml")


@pytest.mark.parametrize("name", SYSTEMS)
def test_docker_compose_accepts_the_file(name: str) -> None:
    text = (EXPECTED / name / "compose.yaml").read_text()
    require_module("compose_spec").PyCompose.from_yaml(text).validate()


@pytest.mark.parametrize("name", SYSTEMS)
def test_kubernetes_accepts_the_manifests(name: str) -> None:
    validator = require_module("kubernetes_validate")
    for manifest in yaml.safe_load_all((EXPECTED / name / "kubernetes.yaml").read_text()):
        validator.validate(manifest, validator.latest_version(), strict=True)


@pytest.mark.parametrize("name", SYSTEMS)
def test_policies_fit_the_schema_of_sros2(name: str) -> None:
    schema = require_module("xmlschema").XMLSchema
    policy_schema = schema(SCHEMAS / "policy.xsd", allow="local")
    policy_schema.validate((EXPECTED / name / "policy.xml").read_text())


@pytest.mark.parametrize("name", SYSTEMS)
def test_systemd_accepts_the_units(name: str, tmp_path: Path) -> None:
    require(shutil.which("systemd-analyze"), "systemd-analyze is not installed (package systemd)")
    paths = []
    for path in (*files(name, "*.service"), *files(name, "*.target")):
        paths.append(tmp_path / path.relative_to(EXPECTED))
        paths[-1].parent.mkdir(exist_ok=True, parents=True)
        text = path.read_text().replace("/opt/ros/python", "/bin/sh")
        paths[-1].write_text(text.replace("/project", str(tmp_path)))
    user = ["--user"] if name == "shutdown" else []
    command = ["systemd-analyze", "verify", *user, *map(str, paths)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=100, check=False)
    assert [line for line in done.stderr.splitlines() if "robot" in line] == []
