"""``compose export``: files with which other tools run a system."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.errors import CommandError
from composer.cli.support.hosts import files_to_copy, write_staying
from composer.cli.support.options import Namespace, NewFile, examples
from composer.cli.support.output.terminal import lines, say, write, write_raw
from composer.cli.support.system_arguments import RunnableSystem, SystemName, runnable_system

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.bridges.export.container_image import Contents
    from composer.bridges.export.deployment import Service
    from composer.loading import LoadResult
    from composer.model import Host, System

app = typer.Typer(
    help="""Write files with which other tools run a system.

    The files are derived from the system: export again after changes.
    """,
    epilog=examples(
        "compose export launch systems/robot.yaml -o launch/robot.launch.py",
        "compose export systemd systems/robot.yaml -o robot.service",
        "compose export docker-compose systems/robot.yaml -o deploy",
        "compose export kubernetes systems/robot.yaml -o deploy",
        "compose export sros2 systems/robot.yaml -o policies/robot.xml",
    ),
    no_args_is_help=True,
    rich_markup_mode=None,
)

#: The host and the path of an image, and a tag or a digest.
_IMAGE = re.compile(r"[A-Za-z0-9][A-Za-z0-9._/:-]*(@[A-Za-z0-9:]+)?")


def _image_name(text: str | None) -> str | None:
    """Return the value of --image. Raises typer.BadParameter."""
    if text is not None and not _IMAGE.fullmatch(text):
        raise typer.BadParameter(f"'{text}' is not the name of an image.")
    return text


NewFolder = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="FOLDER",
        help="Write to files in this folder instead of stdout.",
        show_default=False,
    ),
]
NewPath = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="PATH",
        help="Write to a new file instead of stdout; to a folder if there are several files.",
        show_default=False,
    ),
]
Force = Annotated[bool, typer.Option("--force", help="Replace files that exist.")]
ListFiles = Annotated[
    bool,
    typer.Option(
        "--list", help="List the files of the project that the image holds, and write nothing."
    ),
]
Image = Annotated[
    str | None,
    typer.Option(
        "--image",
        metavar="NAME",
        callback=_image_name,
        help="The name of the image, as in registry.local/robot:1.2.",
        show_default="that of the system",
    ),
]


@app.callback()
def export() -> None:
    """Write files with which other tools run a system.

    The files are derived from the system: export again after changes.
    """


@app.command(
    "launch", epilog=examples("compose export launch pipeline -o launch/pipeline.launch.py")
)
def export_launch(system: SystemName, *, output: NewFile = None, force: Force = False) -> None:
    """Write a launch file that runs a system.

    It has launch arguments for the namespace, simulated time and the log level, and ends with the
    system. To run a system from a launch file of your own, use its action ComposeSystem.
    """
    from composer.bridges.export.launch_file import launch_file

    declared, path, _ = _exported_system(system)
    _write(launch_file(declared, path, output), output, replace=force)


@app.command(
    "systemd",
    epilog=examples(
        "compose export systemd systems/robot.yaml -o robot.service",
        "compose export systemd robot --user -o ~/.config/systemd/user/robot.service",
        "compose export systemd robot -o units       a system with several processes",
    ),
)
def export_systemd(
    system: SystemName,
    *,
    user: Annotated[
        bool, typer.Option("--user", help="For the service manager of a user, not of the system.")
    ] = False,
    output: NewPath = None,
    force: Force = False,
) -> None:
    """Write the systemd units that run a system.

    There is a service for each of its processes, in this Python environment, with the variables of
    ROS that are set now. It runs as you. A process that fails is started again as the system
    declares it. The services of several processes belong to a target.
    """
    import os
    import sys

    from composer.bridges.export.systemd import Installation, units
    from composer.client.hosts.remote_command import python_words

    declared, path, result = _exported_system(system)
    python = (sys.executable, "-P", "-m", "composer")
    file = os.path.relpath(path.resolve(), result.project.root)

    def remote(host: Host, service: Service) -> list[str]:
        return python_words(host, ("-m", "composer", *service.command(file)), os.environ)

    installation = Installation(python, os.environ, remote, None if user else _user())
    found = units(declared, path, installation, user=user)
    if len(found) == 1:
        _write(next(iter(found.values())), output, replace=force)
        return
    if output is None:
        raise CommandError(
            f"there are {len(found)} units: {', '.join(map(str, found))}",
            hint="name a folder for them with --output",
        )
    _write_all(output, {str(name): text for name, text in found.items()}, replace=force)


@app.command(
    "docker-compose",
    epilog=examples(
        "compose export docker-compose systems/robot.yaml -o deploy",
        "compose export docker-compose robot --image registry.local/robot:1 -o deploy --force",
    ),
)
def export_docker_compose(
    system: SystemName,
    *,
    image: Image = None,
    output: NewFolder = None,
    force: Force = False,
    list_files: ListFiles = False,
) -> None:
    """Write a file for docker compose, and a Containerfile.

    Each process of the system is a service, with a health check, the limits that the system
    declares, and the variables of ROS that are set now. All of them use one image with the project.
    On stdout, there is only the compose file.
    """
    import os

    from composer.bridges.export.docker_compose import compose_file

    declared, path, result = _exported_system(system)
    if list_files:
        _list_files(declared, result)
        return
    contents, name = _image(declared, result, path, image)
    build: dict[str, str] = {}
    if output is not None:
        root, folder = result.project.root, output.resolve()
        build["context"] = os.path.relpath(root, folder)
        build["dockerfile"] = os.path.relpath(folder / "Containerfile", root)
    text = compose_file(declared, contents, name, build, os.environ)
    _write_image_and(output, {"compose.yaml": text}, contents, result, replace=force)


@app.command(
    "kubernetes",
    epilog=examples(
        "compose export kubernetes systems/robot.yaml --image registry.local/robot:1 -o deploy",
        "compose export kubernetes systems/robot.yaml | kubectl apply -f -",
    ),
)
def export_kubernetes(
    system: SystemName,
    *,
    image: Image = None,
    output: NewFolder = None,
    force: Force = False,
    list_files: ListFiles = False,
) -> None:
    """Write manifests for Kubernetes, and a Containerfile.

    A pod has the processes of one computer as containers, with probes, the limits that the system
    declares, and the variables of ROS that are set now. On stdout, there are only the manifests.
    """
    import os

    from composer.bridges.export.kubernetes import manifests

    declared, path, result = _exported_system(system)
    if list_files:
        _list_files(declared, result)
        return
    contents, name = _image(declared, result, path, image)
    text = manifests(declared, contents, name, os.environ)
    _write_image_and(output, {"kubernetes.yaml": text}, contents, result, replace=force)


@app.command(
    "sros2",
    epilog=examples(
        "compose export sros2 pipeline -o policies/pipeline.xml",
        "compose export sros2 pipeline --permissions -o keystore/enclaves",
    ),
)
def export_sros2(
    system: SystemName,
    *,
    namespace: Namespace = None,
    permissions: Annotated[
        bool,
        typer.Option(
            "--permissions",
            help="Write the permissions of DDS instead, a file for each process, to a folder.",
        ),
    ] = False,
    output: NewPath = None,
    force: Force = False,
) -> None:
    """Write the access control policy that a system implies.

    Each process may publish, subscribe, serve and call exactly what its nodes declare, and what ROS
    and the manager node need. The policy is for 'ros2 security create_permission'; the enclave of a
    process is its full name, such as /robot1/pipeline.

    With --permissions, write what that command makes of the policy: FOLDER/robot1/pipeline/
    permissions.xml, for the ROS domain of ROS_DOMAIN_ID. These files have to be signed.
    """
    declared = _exported_system(system, namespace=namespace).system
    if not permissions:
        from composer.bridges.export.sros2 import policy

        _write(policy(declared), output, replace=force)
        return
    from composer.bridges.export.dds_permissions import permissions as dds_permissions

    texts = dds_permissions(declared, _domain_id())
    if output is None and len(texts) == 1:
        write_raw(next(iter(texts.values())))
    elif output is None:
        raise CommandError(
            f"there are {len(texts)} processes: {', '.join(texts)}",
            hint="name a folder for their files with --output",
        )
    else:
        files = {f"{path.strip('/')}/permissions.xml": text for path, text in texts.items()}
        _write_all(output, files, replace=force)


def _exported_system(text: str, namespace: str | None = None) -> RunnableSystem:
    """Return a system whose path can be a line of any format. Raises CommandError."""
    found = runnable_system(text, namespace=namespace)
    if not str(found.path.resolve()).isprintable():
        raise CommandError(
            f"the path '{found.path}' has control characters", hint="rename the file or its folder"
        )
    return found


def _user() -> str:
    """Return the name of this user, or the number if there is no name."""
    import os
    import pwd

    number = os.geteuid()
    try:
        return pwd.getpwuid(number).pw_name
    except KeyError:
        return str(number)


def _domain_id() -> int:
    """Return the ROS domain. Raises CommandError."""
    import os

    from composer.model.hosts import domain_problem

    text = os.environ.get("ROS_DOMAIN_ID") or "0"
    if domain_problem(text) is not None:
        raise CommandError(f"ROS_DOMAIN_ID is '{text}', which is not a domain id")
    return int(text)


def _image(
    system: System, result: LoadResult, path: Path, name: str | None
) -> tuple[Contents, str]:
    """Return what the image of a system contains, and its name."""
    from pathlib import PurePosixPath

    from composer.bridges.export.container_image import Contents
    from composer.bridges.export.deployment import services
    from composer.interfaces.sources import Bundle, find_packages
    from composer.model.interface_packages import NOT_IN_WHEELS, used_packages
    from composer.project.copied_files import docker_patterns

    root = result.project.root
    files = files_to_copy(system, root)
    used = sorted(used_packages(system))
    own = find_packages(result.project.interface_folders).folders
    built = [name for name in used if name in NOT_IN_WHEELS and name not in own]
    built += () if own.keys().isdisjoint(used) else own  # behaviors may import the others
    contents = Contents(
        system=system.name.value,
        file=PurePosixPath(path.resolve().relative_to(root).as_posix()),
        has_requirements=(root / "requirements.txt").is_file(),
        interfaces=tuple(built),
        unknown_interfaces=tuple(
            name for name in used if name not in own and name not in Bundle().packages()
        ),
        ignored=(
            tuple(docker_patterns(root)),
            files.docker_patterns,
        ),
    )
    return contents, name or f"{services(system)[0].label}:latest"


def _list_files(system: System, result: LoadResult) -> None:
    """Write the files of the project that are copied into an image, and those that are not."""
    files = files_to_copy(system, result.project.root)
    write(lines(files.copied))
    write_staying(files)


def _write(text: str, output: Path | None, *, replace: bool) -> None:
    """Write to stdout, or to a file. Raises CommandError."""
    if output is None:
        write_raw(text)
        return
    _write_all(output.parent, {output.name: text}, replace=replace)


def _write_image_and(
    folder: Path | None,
    files: dict[str, str | bytes],
    contents: Contents,
    result: LoadResult,
    *,
    replace: bool,
) -> None:
    """Write a file and what builds its image to a folder, or only the text of the file to stdout.

    Two formats may share the image. Raises CommandError.
    """
    from importlib.metadata import PackageNotFoundError
    from pathlib import PurePosixPath

    from composer import DISTRIBUTION
    from composer.bridges.export.container_image import (
        CONTAINERFILE,
        IGNORED_FILES,
        containerfile,
        ignored_files,
    )
    from composer.bridges.export.wheel import wheel

    if folder is None:
        write_raw("".join(map(str, files.values())))
        return
    if not folder.resolve().is_relative_to(result.project.root):
        raise CommandError(
            f"'{folder}' is not in the project '{result.project.root}'",
            hint="images are built from the files of the project",
        )
    try:
        name, data = wheel(DISTRIBUTION)
    except (OSError, PackageNotFoundError) as error:
        raise CommandError(f"cannot make a wheel of the composer: {error}") from error
    place = PurePosixPath(folder.resolve().relative_to(result.project.root).as_posix(), name)
    files |= {
        str(CONTAINERFILE): containerfile(contents, place),
        str(IGNORED_FILES): ignored_files(contents, place),
        name: data,
    }
    _write_all(folder, files, replace=replace)


def _write_all(folder: Path, files: Mapping[str, str | bytes], *, replace: bool) -> None:
    from composer.cli.support.new_files import write_exports

    written = write_exports(folder, files, replace=replace)
    for name in files:
        path = folder / name
        say(f"wrote {path}" if path in written else f"{path} is up to date")
