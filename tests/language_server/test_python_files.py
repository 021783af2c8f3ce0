"""What editors with basedpyright, pyright or Pylance offer and show in behaviors with stubs."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import chdir
from pathlib import Path

import pytest

from tests.cli.compose import compose
from tests.language_server.client import Cursor, LanguageServer
from tests.language_server.robot import MISTAKES, RIGHT, make_project, wrong_lines
from tests.programs import require_package
from tools.draw_editor import PICTURE, ROOT, answers, draw

HERE = Path(__file__).parent
SERVER = HERE / "node_modules/basedpyright/langserver.index.js"
#: The mode of pyright and of Pylance; that of basedpyright reports style as well.
SETTINGS = {"basedpyright": {"analysis": {"typeCheckingMode": "standard"}}}
#: What every message has.
OF_MESSAGES = {"SLOT_TYPES", "get_fields_and_field_types"}


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("python")
    with chdir(folder):
        root = make_project(folder)
    for part in ("nodes", "interfaces"):  # for the picture; a server takes seconds to start
        shutil.copytree(ROOT / part, root / part, dirs_exist_ok=True)
    assert compose("stubs", str(root)).code == 0
    return root


@pytest.fixture(scope="module")
def server(root: Path) -> Iterator[LanguageServer]:
    require_package(HERE, "basedpyright")
    server = LanguageServer(SERVER, root, SETTINGS)
    try:
        yield server
    finally:
        server.close()


def opened(server: LanguageServer, root: Path, code: str, marked: str) -> Cursor:
    """Open the behavior with ``marked`` in place of ``code``."""
    assert RIGHT.count(code) == 1
    name = "".join(letter if letter.isalpha() else "_" for letter in marked)
    return server.open_python(root / f"nodes/{name}.py", RIGHT.replace(code, marked))


@pytest.mark.parametrize(
    ("code", "offered"),
    [
        ("self.publishers.|", "target"),
        ("self.clients.|", "enable"),
        ("self.action_clients.|", "navigate"),
        ("self.parameters.|", "gain frame"),
        ("message.pose.|", "pose covariance"),
        ("message.pose.pose.position.|", "x y z"),
    ],
)
def test_ports_parameters_and_fields_are_offered(
    server: LanguageServer, root: Path, code: str, offered: str
) -> None:
    found = server.complete(opened(server, root, "self.odometry = message", code))
    names = {name for name in found if not name.startswith("__")}
    assert names - OF_MESSAGES == set(offered.split())


@pytest.mark.parametrize(
    ("code", "marked", "shown"),
    [
        ("publishers.target", "publishers.tar|get", "Publisher[PoseStamped]"),
        ("clients.enable", "clients.ena|ble", "Client[Request, Response]"),
        ("parameters.gain", "parameters.ga|in", "float"),
        ("parameters.gain", "parameters.gai|n", "The gain. [1/s]"),
        ("* self.parameters", "* self.param|eters", "TrackerParameters"),
        ("position.x = ", "position.|x = ", "float"),
        ("final = ", "fi|nal = ", "GoalResult[Result]"),
    ],
)
def test_types_and_descriptions_are_shown(
    server: LanguageServer, root: Path, code: str, marked: str, shown: str
) -> None:
    assert shown in server.hover(opened(server, root, code, marked))


def test_mistakes_are_reported_and_nothing_else(server: LanguageServer, root: Path) -> None:
    assert server.errors(server.open_python(root / "nodes/tracker.py", RIGHT)) == {}
    errors = server.errors(server.open_python(root / "nodes/mistakes.py", MISTAKES))
    assert sorted(errors) == wrong_lines(MISTAKES)


def test_the_picture_in_the_guide_shows_what_the_server_answers(
    server: LanguageServer, root: Path
) -> None:
    picture = draw(answers(server, root / "nodes/shown.py"))
    assert picture == PICTURE.read_text(encoding="utf-8"), "run: make pictures"
