"""Files for docker compose and Kubernetes, as their own parsers and schemas read them."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path, PurePosixPath
from typing import Any

import pytest
import yaml

from composer.bridges.export.container_image import Contents, containerfile
from composer.bridges.export.deployment import VARIABLES
from tests.cli.compose import compose
from tests.programs import require_module

SYSTEM = """\
system: my_robot
processes:
  front_camera:
    cpus: [0, 1]
    priority: 50
    memory_mb: 500
    environment:
      {MODE: "1e3", OCTAL: "0o17", TIME: "1:30", ANSWER: "no", YES: y, DATE: "2001-01-01",
       PRICE: "$5 $HOME $(HOME) $$ %d \\"'\\\\ #x", TEXT: "a: b", LONG: LONG, EMPTY: ""}
  arm: {}
nodes:
  camera: {process: front_camera, on_activate: {log: hello}}
  joint: {process: arm, on_activate: {log: hello}}
  viewer: {on_activate: {log: hello}}
"""
SHUTDOWN = "lifecycle: {on_failure: shutdown}\n"
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


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a project with a system, in the current folder."""
    (tmp_path / "systems").mkdir()
    text = SYSTEM.replace("LONG: LONG", f'LONG: "{VALUES["LONG"]}"')
    (tmp_path / "systems" / "robot.yaml").write_text(text)
    monkeypatch.chdir(tmp_path)
    for name in VARIABLES:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    return tmp_path


def test_each_process_has_its_own_enclave(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_SECURITY_ENCLAVE_OVERRIDE", "/my_robot")
    name = "ROS_SECURITY_ENCLAVE_OVERRIDE"
    services = yaml.safe_load(export("docker-compose"))["services"]
    assert services["my-robot"]["environment"][name] == "/my_robot"
    assert services["my-robot-arm"]["environment"][name] == "/my_robot/arm"
    (deployment,) = kubernetes()
    arm = deployment["spec"]["template"]["spec"]["containers"][2]
    assert {"name": name, "value": "/my_robot/arm"} in arm["env"]


def add(project: Path, text: str) -> None:
    with (project / "systems" / "robot.yaml").open("a") as file:
        file.write(text)


def export(kind: str, *options: str) -> str:
    done = compose("export", kind, "robot", *options)
    assert done.code == 0, done.err
    return done.out


def kubernetes(*options: str) -> list[dict[str, Any]]:
    """Return the manifests, after the schemas of Kubernetes have accepted them."""
    validator = require_module("kubernetes_validate")
    found = list(yaml.safe_load_all(export("kubernetes", *options)))
    for manifest in found:
        validator.validate(manifest, validator.latest_version(), strict=True)
    return found


def test_docker_compose_reads_what_the_system_declares(project: Path) -> None:
    parser = require_module("compose_spec")
    export("docker-compose", "-o", "deploy")
    text = (project / "deploy" / "compose.yaml").read_text()
    parser.PyCompose.from_yaml(text).validate()
    document = yaml.safe_load(text)
    assert document["name"] == "my-robot"
    services = document["services"]
    assert list(services) == ["my-robot", "my-robot-front-camera", "my-robot-arm"]
    robot, camera = services["my-robot"], services["my-robot-front-camera"]
    assert robot["depends_on"] == ["my-robot-front-camera", "my-robot-arm"]
    assert robot["command"] == ["compose", "run", "systems/robot.yaml", "--await-processes"]
    assert robot["restart"] == "unless-stopped"
    assert robot["build"] == {"context": "..", "dockerfile": "deploy/Containerfile"}
    assert [service["image"] for service in services.values()] == ["my-robot:latest"] * 3
    assert [name for name in services if "build" in services[name]] == ["my-robot"]
    assert robot["environment"] == {"ROS_DOMAIN_ID": "7"}
    assert camera["command"][2:] == ["systems/robot.yaml", "--process", "front_camera"]
    assert camera["cpuset"] == "0,1"
    assert camera["deploy"]["resources"]["limits"]["memory"] == "500000000b"
    assert camera["ulimits"] == {"rtprio": 50}
    assert camera["healthcheck"]["test"][1:] == [
        "compose",
        "ps",
        "/my_robot/front_camera",
        "--ready",
    ]
    variables = {name: value.replace("$$", "$") for name, value in camera["environment"].items()}
    assert variables == {"ROS_DOMAIN_ID": "7", **VALUES}


def test_docker_itself_reads_the_file(project: Path) -> None:
    docker = shutil.which("docker")
    if docker is None or subprocess.run([docker, "compose", "version"], check=False).returncode:
        pytest.skip("needs docker compose")
    export("docker-compose", "-o", "deploy")
    command = [docker, "compose", "-f", "deploy/compose.yaml", "config"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    services = yaml.safe_load(done.stdout)["services"]
    camera = services["my-robot-front-camera"]
    printed = {name: text.replace("$$", "$") for name, text in camera["environment"].items()}
    assert printed == {"ROS_DOMAIN_ID": "7", **VALUES}
    assert services["my-robot"]["build"]["context"] == str(project)


def test_kubernetes_accepts_the_manifests(project: Path) -> None:
    (deployment,) = kubernetes("--image", "registry.local/robot:1")
    assert (deployment["kind"], deployment["metadata"]["name"]) == ("Deployment", "my-robot")
    pod = deployment["spec"]["template"]["spec"]
    assert "hostNetwork" not in pod  # it has no part outside
    names = [container["name"] for container in pod["containers"]]
    assert names == ["my-robot", "my-robot-front-camera", "my-robot-arm"]
    robot, camera, _ = pod["containers"]
    assert robot["image"] == "registry.local/robot:1"
    limits = {"cpu": "2", "memory": "500000000"}
    assert camera["resources"] == {"limits": limits, "requests": limits}
    assert camera["readinessProbe"]["exec"]["command"][2:] == ["/my_robot/front_camera", "--ready"]
    assert camera["livenessProbe"]["exec"]["command"][2:] == ["/my_robot/front_camera"]
    assert {"name": "shared-memory", "mountPath": "/dev/shm"} in camera["volumeMounts"]
    # Kubernetes makes $ of $$, and replaces $(NAME).
    values = {item["name"]: item["value"].replace("$$", "$") for item in camera["env"]}
    assert values == {"ROS_DOMAIN_ID": "7", **VALUES}


def test_each_computer_has_a_pod_in_the_network_of_its_computer(project: Path) -> None:
    path = project / "systems" / "robot.yaml"
    path.write_text(SYSTEM.replace("  arm: {}", "  arm: {host: jetson}"))
    add(project, "hosts: {jetson: {}}\n")
    first, second = kubernetes()
    assert second["metadata"]["name"] == "my-robot-arm"
    pods = [item["spec"]["template"]["spec"] for item in (first, second)]
    assert [pod["hostNetwork"] and pod["hostIPC"] for pod in pods] == [True, True]
    assert "nodeSelector" not in pods[0]
    assert pods[1]["nodeSelector"] == {"kubernetes.io/hostname": "jetson"}
    export("docker-compose", "-o", "deploy")
    text = (project / "deploy" / "compose.yaml").read_text()
    services = yaml.safe_load(text)["services"]
    assert services["my-robot-arm"]["profiles"] == ["jetson"]
    assert "# On jetson: docker compose up --build my-robot-arm\n" in text
    # One for each computer, which builds the image there.
    assert [name for name in services if "build" in services[name]] == ["my-robot", "my-robot-arm"]


def test_a_discovery_server_is_ready_before_the_processes_start(project: Path) -> None:
    add(project, "discovery: {kind: server, address: 10.0.0.1, start: true}\n")
    ask = ["compose", "hosts", "discovery-server", "systems/robot.yaml", "--ready"]
    (deployment,) = kubernetes()
    pod = deployment["spec"]["template"]["spec"]
    assert pod["hostNetwork"]  # where the address is
    note = "The pod belongs on the computer with the address of the discovery server."
    assert note in export("kubernetes")
    (server,) = pod["initContainers"]
    assert (server["name"], server["restartPolicy"]) == ("my-robot-discovery", "Always")
    assert server["command"] == ask[:-1]
    assert server["startupProbe"]["exec"]["command"] == ask
    found = yaml.safe_load(export("docker-compose"))["services"]
    assert found["my-robot-discovery"]["healthcheck"]["test"] == ["CMD", *ask]
    healthy = {"my-robot-discovery": {"condition": "service_healthy"}}
    assert found["my-robot-arm"]["depends_on"] == healthy
    others = found["my-robot"]["depends_on"]
    assert others.items() > healthy.items()
    assert others["my-robot-arm"] == {"condition": "service_started"}
    assert "depends_on" not in found["my-robot-discovery"]

    path = project / "systems" / "robot.yaml"
    text = path.read_text()
    path.write_text(text + "hosts: {base: {address: 10.0.0.1}}\n")
    _, deployment = kubernetes()
    pod = deployment["spec"]["template"]["spec"]
    assert pod["nodeSelector"] == {"kubernetes.io/hostname": "base"}
    assert [container["name"] for container in pod["containers"]] == ["my-robot-discovery-base"]
    assert note not in export("kubernetes")

    path.write_text(text.replace("10.0.0.1", "127.0.0.1"))
    (deployment,) = kubernetes()
    assert "hostNetwork" not in deployment["spec"]["template"]["spec"]
    assert note not in export("kubernetes")


def test_a_failure_ends_a_system_that_shuts_down_on_failure(project: Path) -> None:
    add(project, SHUTDOWN)
    (job,) = kubernetes()
    assert (job["kind"], job["spec"]["backoffLimit"]) == ("Job", 0)
    pod = job["spec"]["template"]["spec"]
    # Kubernetes ends the others when this one has ended, and so the job.
    assert [container["name"] for container in pod["containers"]] == ["my-robot"]
    others = {item["name"]: item["restartPolicy"] for item in pod["initContainers"]}
    assert others == {"my-robot-front-camera": "Always", "my-robot-arm": "Always"}
    text = export("docker-compose")
    assert "docker compose up --abort-on-container-exit\n" in text
    services = yaml.safe_load(text)["services"]
    assert {service["restart"] for service in services.values()} == {"no"}


def test_the_image_has_what_the_project_needs(project: Path) -> None:
    export("docker-compose", "-o", "deploy")
    text = (project / "deploy" / "Containerfile").read_text()
    assert 'COPY ["deploy/ros2_composer-' in text
    assert "requirements.txt" not in text
    assert "interface build" not in text
    assert "RUN compose validate systems/robot.yaml\n" in text
    (project / "requirements.txt").write_text("numpy\n")
    package = project / "interfaces" / "my_msgs"
    (package / "msg").mkdir(parents=True)
    (package / "msg" / "Status.msg").write_text("bool ok\n")
    (package / "package.xml").write_text("<package><name>my_msgs</name></package>\n")
    publisher = "publishers: {status: {type: my_msgs/msg/Status, qos: command, external: true}}"
    add(project, f"  reporter: {{{publisher}}}\n")
    done = compose("export", "docker-compose", "robot", "-o", "deploy")
    assert done.code == 1
    assert "'deploy/Containerfile' exists already\n  --force replaces it" in done.err
    export("docker-compose", "-o", "deploy", "--force")
    text = (project / "deploy" / "Containerfile").read_text()
    assert "COPY requirements.txt .\n" in text
    assert "&& compose interface build my_msgs \\\n" in text
    assert "Not in the image" not in text


def test_the_image_has_the_interfaces_that_ros_on_pypi_lacks(project: Path) -> None:
    port = "publishers: {found: {type: other_msgs/msg/Found, qos: command}}"
    laser = "transforms: {static: {laser: {parent: base, translation_m: {x: 1}}}}"
    add(project, f"  finder: {{{port}, on_activate: {{log: hello}}}}\n  laser: {{{laser}}}\n")
    (project / "composer.yaml").touch()
    for package, field in (("other_msgs", "bool ok"), ("base_msgs", "bool ok")):
        folder = project / "interfaces" / package
        (folder / "msg").mkdir(parents=True)
        (folder / "msg" / "Found.msg").write_text(f"{field}\n")
        (folder / "package.xml").write_text(f"<package><name>{package}</name></package>\n")
    export("docker-compose", "-o", "deploy")
    text = (project / "deploy" / "Containerfile").read_text()
    (line,) = (line for line in text.splitlines() if "interface build" in line)
    assert set(line.split()[4:-1]) == {"tf2_msgs", "other_msgs", "base_msgs"}


def test_the_file_of_the_image_names_the_interfaces_that_it_lacks() -> None:
    contents = Contents("robot", PurePosixPath("robot.yaml"))
    place = PurePosixPath("deploy/composer.whl")
    assert "Not in the image" not in containerfile(contents, place)
    text = containerfile(replace(contents, unknown_interfaces=("acme_msgs", "lab_msgs")), place)
    assert "# Not in the image, unless requirements.txt adds them: acme_msgs, lab_msgs\n" in text


def test_the_image_has_no_secrets(project: Path) -> None:
    add(project, "hosts: {jetson: {identity_file: keys/robot}, arm: {identity_file: ~/.ssh/id}}\n")
    (project / ".gitignore").write_text("/deploy\n")
    (project / ".env").write_text("PASSWORD=x\n")
    export("docker-compose", "-o", "deploy")
    export("docker-compose", "-o", "deploy", "--force")  # the folder exists now
    ignored = (project / "deploy" / "Containerfile.dockerignore").read_text().splitlines()
    folder, wheel, *files = ignored[-4:]
    assert folder == "/deploy"
    assert wheel.startswith("!/deploy/ros2_composer-")
    assert files == ["/.env", "/keys/robot"]
    assert not [line for line in ignored if ".ssh" in line]
    done = compose("export", "kubernetes", "robot", "--list")
    assert done.out.splitlines() == [
        ".gitignore",
        "systems/robot.yaml",
        "not copied: .env (a secret, by its name)",
        "not copied: deploy (ignored by .gitignore)",
        "not copied: keys/robot (the private key of a host)",
    ]


def test_two_formats_share_the_image(project: Path) -> None:
    export("docker-compose", "-o", "deploy")
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


def test_the_commands_of_the_guide_work(project: Path) -> None:
    guide = Path(__file__).parents[4] / "docs" / "guides" / "exporting.md"
    lines = [line.removeprefix("$ compose ") for line in guide.read_text().splitlines()]
    commands = [line.split() for line in lines if line.startswith("export ")]
    assert [words[1] for words in commands] == [
        *("launch", "systemd", "systemd", "docker-compose", "kubernetes", "sros2", "sros2")
    ]
    commands.pop(1)  # the unit of a system with one process: this one has several
    for words in commands:
        done = compose(*words)
        assert done.code == 0, done.err
    assert sorted(str(path.relative_to(project)) for path in project.rglob("*.xml")) == [
        "keystore/enclaves/my_robot/arm/permissions.xml",
        "keystore/enclaves/my_robot/front_camera/permissions.xml",
        "keystore/enclaves/my_robot/permissions.xml",
        "policies/robot.xml",
    ]


def test_labels_are_unique_and_short(project: Path) -> None:
    first, second, third = "a" * 40 + "b" * 40, "a" * 40 + "b" * 41, "c_d"
    processes = f"{first}: {{nodes: [x]}}, {second}: {{nodes: [y]}}, {third}: {{nodes: [z]}}"
    nodes = ", ".join(f"{name}: {{on_activate: {{log: hello}}}}" for name in "xyz")
    text = f"system: r\nprocesses: {{{processes}}}\nnodes: {{{nodes}}}\n"
    (project / "systems" / "robot.yaml").write_text(text)
    (deployment,) = kubernetes()
    names = [item["name"] for item in deployment["spec"]["template"]["spec"]["containers"]]
    assert names[1:] == [names[1], f"{names[1]}-2", "r-c-d"]
    assert max(map(len, names)) <= 63
