"""``compose export docker-compose`` and ``kubernetes``: a system in container images."""

from __future__ import annotations

import os
import re
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Annotated, Unpack

import typer

from composer.cli.support.errors import CommandError
from composer.cli.support.hosts import files_to_copy, write_staying
from composer.cli.support.name_values import Arguments
from composer.cli.support.new_files import write_and_say
from composer.cli.support.options import examples
from composer.cli.support.system_arguments import (
    LoadOptions,
    RunnableSystem,
    SystemName,
    runnable_system,
)
from composer.cli.support.terminal import lines, write, write_raw

if TYPE_CHECKING:
    from composer.bridges.export.container_image import Contents
    from composer.loading.reported import LoadResult
    from composer.model import System

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
        "--output", "-o", metavar="FOLDER", help="Write to files in this folder instead of stdout."
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
        show_default="the name of the system",
    ),
]


def add_image_commands(app: typer.Typer) -> None:
    """Add the commands to ``compose export``."""
    app.command(
        "docker-compose",
        epilog=examples(
            "compose export docker-compose systems/robot.yaml -o deploy",
            "compose export docker-compose robot --image registry.local/robot:1 -o deploy --force",
        ),
    )(export_docker_compose)
    app.command(
        "kubernetes",
        epilog=examples(
            "compose export kubernetes systems/robot.yaml --image registry.local/robot:1 -o deploy",
            "compose export kubernetes systems/robot.yaml | kubectl apply -f -",
        ),
    )(export_kubernetes)


def export_docker_compose(
    system: SystemName,
    arguments: Arguments = None,
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
    from composer.bridges.export.container_image import compose_file

    declared, path, result = exported_system(system, arguments)
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


def export_kubernetes(
    system: SystemName,
    arguments: Arguments = None,
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
    from composer.bridges.export.kubernetes import manifests

    declared, path, result = exported_system(system, arguments)
    if list_files:
        _list_files(declared, result)
        return
    contents, name = _image(declared, result, path, image)
    text = manifests(declared, contents, name, os.environ)
    _write_image_and(output, {"kubernetes.yaml": text}, contents, result, replace=force)


def exported_system(
    text: str, arguments: list[str] | None = None, **options: Unpack[LoadOptions]
) -> RunnableSystem:
    """Return a system whose path can be a line of any format. Raises CommandError."""
    found = runnable_system(text, arguments, **options)
    if not str(found.path.resolve()).isprintable():
        raise CommandError(
            f"the path '{found.path}' has control characters", hint="rename the file or its folder"
        )
    return found


def _image(
    system: System, result: LoadResult, path: Path, name: str | None
) -> tuple[Contents, str]:
    """Return what the image of a system contains, and its name."""
    from composer.bridges.export.container_image import Contents
    from composer.bridges.export.deployment import services
    from composer.interfaces.sources import Bundle, find_packages
    from composer.model.interface_packages import NOT_IN_WHEELS, used_packages
    from composer.project.copied_files import patterns_for_images

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
        ignored=(tuple(patterns_for_images(root)), files.docker_patterns),
    )
    return contents, name or f"{services(system)[0].label}:latest"


def _list_files(system: System, result: LoadResult) -> None:
    """Write the files of the project that are copied into an image, and those that are not."""
    files = files_to_copy(system, result.project.root)
    write(lines(files.copied))
    write_staying(files)


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

    from composer import DISTRIBUTION
    from composer.bridges.export.container_image import (
        CONTAINERFILE,
        IGNORED_FILES,
        containerfile,
        ignored_files,
        wheel,
    )

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
    write_and_say(folder, files, replace=replace)
