"""Files for docker compose and Kubernetes, as their own parsers and schemas read them."""

from __future__ import annotations

import json
from importlib.metadata import version
from pathlib import Path

import pytest
import yaml

from composer.bridges.export.deployment import VARIABLES
from tests.cli.compose import compose
from tests.unit.support.checking import write_files

VALUES = {
    "MODE": "1e3",
    "OCTAL": "0o17",
    "TIME": "1:30",
    "ANSWER": "no",
    "YES": "y",
    "DATE": "2001-01-01",
    "PRICE": "$5 $HOME $(HOME) $$ %d \"'\\ #x",
    "TEXT": "a: b",
    "LONG": "x" * 300 + " y" * 6000 + " #1: " * 10,
    "EMPTY": "",
}
SYSTEM = f"""\
system: my_robot
processes:
  front_camera:
    cpus: [0, 1]
    priority: 50
    memory_mb: 500
    environment: {json.dumps(VALUES)}
  arm: {{}}
nodes:
  camera: {{process: front_camera, on_activate: {{log: hello}}}}
  joint: {{process: arm, on_activate: {{log: hello}}}}
  viewer: {{on_activate: {{log: hello}}}}
"""


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a project with a system, in the current folder."""
    write_files(tmp_path, {"systems/robot.yaml": SYSTEM})
    monkeypatch.chdir(tmp_path)
    for name in VARIABLES:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    return tmp_path


def environments() -> list[dict[str, str]]:
    """Return the variables of the three processes for docker compose, and then for Kubernetes.

    Both make ``$`` of ``$$``, and replace other variables.
    """
    services = yaml.safe_load(export("docker-compose"))["services"].values()
    (deployment,) = yaml.safe_load_all(export("kubernetes"))
    containers = deployment["spec"]["template"]["spec"]["containers"]
    listed = [service["environment"].items() for service in services]
    listed += [[(item["name"], item["value"]) for item in each["env"]] for each in containers]
    return [{name: value.replace("$$", "$") for name, value in items} for items in listed]


def test_each_process_has_its_variables(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ros = {"ROS_DOMAIN_ID": "7"}
    assert environments() == [ros, ros | VALUES, ros] * 2
    enclave = "ROS_SECURITY_ENCLAVE_OVERRIDE"
    monkeypatch.setenv(enclave, "/my_robot")
    enclaves = ["/my_robot", "/my_robot/front_camera", "/my_robot/arm"]
    assert [found[enclave] for found in environments()] == enclaves * 2


def add(project: Path, text: str) -> None:
    with (project / "systems" / "robot.yaml").open("a") as file:
        file.write(text)


def export(kind: str, *options: str) -> str:
    done = compose("export", kind, "robot", *options)
    assert done.code == 0, done.err
    return done.out


def export_image(project: Path, *options: str) -> str:
    """Return the text of the Containerfile."""
    export("docker-compose", "-o", "deploy", *options)
    return (project / "deploy" / "Containerfile").read_text()


def interface_package(name: str, message: str) -> dict[str, str]:
    folder = f"interfaces/{name}"
    return {
        f"{folder}/msg/{message}.msg": "bool ok\n",
        f"{folder}/package.xml": f"<package><name>{name}</name></package>\n",
    }


def test_the_image_has_what_the_project_needs(project: Path) -> None:
    text = export_image(project)
    assert 'COPY ["deploy/ros2_composer-' in text
    assert "requirements.txt" not in text
    assert "interface build" not in text
    assert "RUN compose validate systems/robot.yaml\n" in text
    write_files(project, {"requirements.txt": "numpy\n", **interface_package("my_msgs", "Status")})
    publisher = "publishers: {status: {type: my_msgs/msg/Status, qos: command, external: true}}"
    add(project, f"  reporter: {{{publisher}}}\n")
    done = compose("export", "docker-compose", "robot", "-o", "deploy")
    assert done.code == 1
    assert "'deploy/Containerfile' exists already\n  --force replaces it" in done.err
    text = export_image(project, "--force")
    assert "COPY requirements.txt .\n" in text
    assert "&& compose interface build my_msgs \\\n" in text
    assert "Not in the image" not in text
    # Another format has the same image.
    done = compose("export", "kubernetes", "robot", "-o", "deploy")
    assert done.code == 0, done.err
    assert "deploy/Containerfile is up to date" in done.err
    assert sorted(path.name for path in (project / "deploy").iterdir()) == [
        "Containerfile",
        "Containerfile.dockerignore",
        "compose.yaml",
        "kubernetes.yaml",
        f"ros2_composer-{version('ros2-composer')}-py3-none-any.whl",
    ]


def test_the_image_has_the_interfaces_that_ros_on_pypi_lacks(project: Path) -> None:
    port = "publishers: {found: {type: other_msgs/msg/Found, qos: command}}"
    laser = "transforms: {static: {laser: {parent: base, translation_m: {x: 1}}}}"
    add(project, f"  finder: {{{port}, on_activate: {{log: hello}}}}\n  laser: {{{laser}}}\n")
    packages = interface_package("other_msgs", "Found") | interface_package("base_msgs", "Found")
    write_files(project, {"composer.yaml": "", **packages})
    text = export_image(project)
    (line,) = (line for line in text.splitlines() if "interface build" in line)
    assert set(line.split()[4:-1]) == {"tf2_msgs", "other_msgs", "base_msgs"}


def test_the_image_has_no_secrets(project: Path) -> None:
    add(project, "hosts: {jetson: {identity_file: keys/robot}, arm: {identity_file: ~/.ssh/id}}\n")
    write_files(project, {".gitignore": "/deploy\n", ".env": "PASSWORD=x\n"})
    export_image(project)
    export_image(project, "--force")  # the folder exists now
    ignored = (project / "deploy" / "Containerfile.dockerignore").read_text().splitlines()
    folder, wheel, *files = ignored[-4:]
    assert (folder, files) == ("/deploy", ["/.env", "/keys/robot"])
    assert wheel.startswith("!/deploy/ros2_composer-")
    assert not [line for line in ignored if ".ssh/" in line]
    done = compose("export", "kubernetes", "robot", "--list")
    assert done.out.splitlines() == [
        ".gitignore",
        "systems/robot.yaml",
        "not copied: .env (a secret, by its name)",
        "not copied: deploy (ignored by .gitignore)",
        "not copied: keys/robot (the private key of a host)",
    ]


def test_a_home_folder_is_not_copied(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (project / "link").symlink_to(project)
    monkeypatch.setenv("HOME", str(project / "link"))
    write_files(project, {"robot.yaml": SYSTEM})
    done = compose("export", "kubernetes", "robot.yaml", "--list")
    assert done.code == 1
    assert f"the root of the project is '{project}', which is not copied" in done.err


def test_the_commands_of_the_guide_work(project: Path) -> None:
    guide = Path(__file__).parents[4] / "docs" / "guides" / "exporting.md"
    lines = [line.removeprefix("$ compose ") for line in guide.read_text().splitlines()]
    commands = [line.split() for line in lines if line.startswith("export ")]
    assert [words[1] for words in commands] == [
        *("launch", "systemd", "systemd", "docker-compose", "kubernetes", "sros2")
    ]
    commands.pop(1)  # the unit of a system with one process: this one has several
    for words in commands:
        done = compose(*words)
        assert done.code == 0, done.err
    assert sorted(str(path.relative_to(project)) for path in project.rglob("*.xml")) == [
        "policies/robot.xml"
    ]


def test_labels_are_unique_and_short(project: Path) -> None:
    first, second, third = "a" * 40 + "b" * 40, "a" * 40 + "b" * 41, "c_d"
    processes = f"{first}: {{nodes: [x]}}, {second}: {{nodes: [y]}}, {third}: {{nodes: [z]}}"
    nodes = ", ".join(f"{name}: {{on_activate: {{log: hello}}}}" for name in "xyz")
    text = f"system: r\nprocesses: {{{processes}}}\nnodes: {{{nodes}}}\n"
    (project / "systems" / "robot.yaml").write_text(text)
    (deployment,) = yaml.safe_load_all(export("kubernetes"))
    names = [item["name"] for item in deployment["spec"]["template"]["spec"]["containers"]]
    assert names[1:] == [names[1], f"{names[1]}-2", "r-c-d"]
    assert max(map(len, names)) <= 63
