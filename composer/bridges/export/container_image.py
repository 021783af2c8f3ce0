"""The image that the containers of a system have in common, and a file for docker compose.

The image has a wheel of the composer as it is installed here: no package index need have it. See
packaging.python.org/en/latest/specifications/binary-distribution-format. With the file, docker
compose runs one service for each process of the system.
"""

from __future__ import annotations

import base64
import hashlib
import io
import json
import shlex
import zipfile
from collections.abc import Iterator, Mapping
from importlib.metadata import Distribution, distribution
from pathlib import Path, PurePosixPath
from typing import Any

from composer.base.fast_dataclass import dataclass
from composer.base.folders import data_folder
from composer.bridges.export.deployment import (
    STOP_WITHIN_S,
    Service,
    is_restarted,
    ros_variables,
    services,
    without_variables,
    yaml_text,
)
from composer.bridges.templates import filled
from composer.model import System
from composer.project.copied_files import pattern_of

CONTAINERFILE = PurePosixPath("Containerfile")
#: Where BuildKit and podman look for it first.
IGNORED_FILES = PurePosixPath("Containerfile.dockerignore")
#: In the image. It is the id of the first user of most installations, whose nodes share memory.
USER_ID = 1000
PROJECT = "/project"
WRITABLE = "/tmp"  # noqa: S108  (of the container)
_REQUIREMENTS = """\
COPY requirements.txt .
RUN pip install --no-cache-dir -r requirements.txt

"""
_INTERFACES = """\
RUN apt-get update && apt-get install -y --no-install-recommends g++ \\
    && compose interface build {packages} \\
    && apt-get purge -y --auto-remove g++ && rm -rf /var/lib/apt/lists/* build
"""
_UNKNOWN = """\
# Not in the image, unless requirements.txt adds them: {packages}
"""
_IGNORED = """\
# Written by 'compose export': files of the project that are not copied into the image.
"""

_PACKAGE = Path(__file__).resolve().parents[2]
#: Besides the package, in a checkout; in an installation, they are in the package.
_SHARED = ("docs/rules", "interfaces", "nodes", "schemas", "systems")
_ABOUT = "Wheel-Version: 1.0\nGenerator: compose export\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
_HEAD = """\
# Written by 'compose export docker-compose' for the system {system}.
#
#   docker compose up --build       docker compose ps       docker compose logs -f
"""
_END = """\
#
# 'on_failure: shutdown' of the system: let all processes end with the first one that ends.
#
#   docker compose up --abort-on-container-exit
"""
_HOST = (
    "ROS nodes of one computer exchange messages by shared memory. Containers do as well if they\n"
    "share network and IPC with the computer, and run as the same user as its other nodes."
)


@dataclass(frozen=True, slots=True)
class Contents:
    """What is in the image of a system.

    ``file`` is the file of the system below the root of its project. ``python`` is the version of
    Python (3.12).
    ``has_requirements`` is whether the project has a requirements.txt. ``interfaces`` are interface
    packages to be compiled, ``unknown_interfaces`` those of which there are no definitions here.
    ``ignored`` are the patterns for docker of files that are not in it, first those that hold for
    files made later, then those of files that exist.
    """

    system: str
    file: PurePosixPath
    python: str = "3.12"
    has_requirements: bool = False
    interfaces: tuple[str, ...] = ()
    unknown_interfaces: tuple[str, ...] = ()
    ignored: tuple[tuple[str, ...], tuple[str, ...]] = ((), ())

    @property
    def run(self) -> list[str]:
        """The command that runs the system in the image."""
        return ["compose", "run", str(self.file)]


def containerfile(contents: Contents, wheel: PurePosixPath) -> str:
    """Return the Containerfile, which docker and podman build.

    ``wheel`` is the wheel of the composer below the root of the project.
    """
    return filled(
        "Containerfile",
        system=contents.system,
        python=contents.python,
        wheel=wheel.name,
        copied=json.dumps([str(wheel), f"{WRITABLE}/"]),
        temporary=WRITABLE,
        project=PROJECT,
        requirements=_REQUIREMENTS if contents.has_requirements else "",
        interfaces=_INTERFACES.format(packages=shlex.join(contents.interfaces))
        if contents.interfaces
        else "",
        unknown=_UNKNOWN.format(packages=", ".join(contents.unknown_interfaces))
        if contents.unknown_interfaces
        else "",
        file=shlex.quote(str(contents.file)),
        writable=WRITABLE,
        user=str(USER_ID),
        command=json.dumps(contents.run),
    )


def ignored_files(contents: Contents, wheel: PurePosixPath) -> str:
    """Return the patterns of files that are not copied into the image."""
    general, files = contents.ignored
    folders = {pattern_of(str(path)) for path in wheel.parents}  # may be ignored by git
    first = [line for line in files if line in folders]
    last = [line for line in files if line not in folders]
    lines = (*general, *first, f"!{pattern_of(str(wheel))}", *last)
    return _IGNORED + "".join(f"{line}\n" for line in lines)


def wheel(distribution_name: str) -> tuple[str, bytes]:
    """Return the name and the content of the wheel, the same for the same files.

    Raises PackageNotFoundError if the composer is not installed, and OSError.
    """
    installed = distribution(distribution_name)
    name = f"{distribution_name.replace('-', '_')}-{installed.version}"
    info = f"{name}.dist-info"
    files = dict(_package())
    files |= {f"{info}/{path}": data for path, data in _metadata(installed)}
    record = [f"{path},{_digest(data)},{len(data)}\n" for path, data in files.items()]
    files[f"{info}/RECORD"] = "".join([*record, f"{info}/RECORD,,\n"]).encode()
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, data in files.items():
            archive.writestr(zipfile.ZipInfo(path), data, zipfile.ZIP_DEFLATED)
    return f"{name}-py3-none-any.whl", content.getvalue()


def _package() -> Iterator[tuple[str, bytes]]:
    yield from _below(_PACKAGE, "composer")
    if data_folder() != _PACKAGE / "share":
        for name in _SHARED:
            yield from _below(data_folder() / name, f"composer/share/{Path(name).name}")


def _below(folder: Path, prefix: str) -> Iterator[tuple[str, bytes]]:
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.parent.name != "__pycache__":
            yield f"{prefix}/{path.relative_to(folder).as_posix()}", path.read_bytes()


def _metadata(installed: Distribution) -> Iterator[tuple[str, bytes]]:
    about = installed.read_text("METADATA") or installed.read_text("PKG-INFO") or ""
    yield "METADATA", about.encode()
    yield "WHEEL", _ABOUT.encode()
    yield "entry_points.txt", (installed.read_text("entry_points.txt") or "").encode()
    for path in installed.files or ():
        _, found, license_name = path.as_posix().partition(".dist-info/licenses/")
        if found:
            yield f"licenses/{license_name}", Path(str(path.locate())).read_bytes()


def _digest(data: bytes) -> str:
    digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip("=")
    return f"sha256={digest}"


def compose_file(
    system: System,
    contents: Contents,
    image: str,
    build: Mapping[str, str],
    environment: Mapping[str, str],
) -> str:
    """Return the compose file of a system.

    ``build`` has the keys ``context`` and ``dockerfile``; if it is empty, the image is only used.
    Docker builds in parallel, and fails if two services build the same image: the first service of
    each computer does, for all.
    Of ``environment``, the variables that ROS reads become part of the file.
    """
    listed = services(system)
    common = {
        "init": True,
        "#1": _HOST,
        "network_mode": "host",
        "ipc": "host",
        "read_only": True,
        "tmpfs": [WRITABLE],
        "cap_drop": ["ALL"],
        "security_opt": ["no-new-privileges:true"],
        "stop_grace_period": f"{STOP_WITHIN_S}s",
    }
    found: dict[str, Any] = {}
    hosts: set[str | None] = set()
    for number, service in enumerate(listed):
        if len(listed) > 1:
            found[f"#{number}"] = service.origin
        builds = build and service.host not in hosts
        hosts.add(service.host)
        found[service.label] = {
            "image": image,
            **({"build": dict(build)} if builds else {}),
            **common,
            "command": ["compose", *service.command(str(contents.file))],
            **_conditional(system, service, listed),
            **_limits(service),
            "environment": ros_variables(environment, service) | service.environment,
            "healthcheck": {
                "test": ["CMD", "compose", *service.readiness(str(contents.file))],
                "interval": "10s",
                "timeout": "8s",
                "retries": 3,
                "start_period": "60s",
            },
        }
        if not found[service.label]["environment"]:
            del found[service.label]["environment"]
    document = {"name": listed[0].label, "services": found}
    end = _END if len(listed) > 1 and not is_restarted(system) else ""
    return _HEAD.format(system=system.name) + end + yaml_text(without_variables(document))


def _conditional(system: System, service: Service, listed: tuple[Service, ...]) -> dict[str, Any]:
    here = [item for item in listed if item.host == service.host]
    others = [item for item in here if item is not service]
    found: dict[str, Any] = {}
    servers = {item.label: {"condition": "service_healthy"} for item in others if item.is_server}
    members: list[str] = []
    if service.is_coordinator:
        members = [item.label for item in others if not item.is_server]
    if members:
        found["#2"] = "It is stopped before the others, whose nodes it takes down in order."
    if servers and not service.is_server:
        found["depends_on"] = servers | {name: {"condition": "service_started"} for name in members}
    elif members:
        found["depends_on"] = members
    if service.host is not None:
        labels = " ".join(item.label for item in here)
        found["#3"] = f"On {service.host}: docker compose up --build {labels}"
        found["profiles"] = [service.host]
    if is_restarted(system) or service.is_server:
        found["restart"] = "unless-stopped"
    else:
        found["#4"] = "'on_failure: shutdown' of the system: a failure ends it."
        found["restart"] = "no"
    return found


def _limits(service: Service) -> dict[str, Any]:
    found: dict[str, Any] = {}
    if service.cpus:
        found["cpuset"] = ",".join(map(str, service.cpus))
    if service.memory_bytes is not None:
        found["deploy"] = {"resources": {"limits": {"memory": f"{service.memory_bytes}b"}}}
    if service.priority is not None:
        found["ulimits"] = {"rtprio": service.priority}
    return found
