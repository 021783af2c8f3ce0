"""Code as well-kept packages of Python have it: nothing is reported."""

from __future__ import annotations

from pathlib import Path

from tests.unit.support.checking import diagnostics_in

SYSTEM = "system: demo\nnodes: {lab: {behavior: lab:Lab}}\n"
CODE = """\
import os
import sys
from composer.behavior import Behavior
from rpds import List
from std_msgs.msg import String

if sys.version_info >= (3, 99):
    from typing import Later
else:
    Later = None
if sys.platform == "win32":
    import winreg_of_windows
    os.startfile("a.txt")
if sys.version_info < (3, 11):
    import tomli_of_old_python as tomllib
else:
    import tomllib


def longer(links: List[int]):
    return links.push_front(1)


class Uri:
    def __init__(self, text: str) -> None:
        self.text = text


def takes_uri(uri: Uri) -> Uri:
    return uri


class Extension:
    pass


class Base:
    def __new__(cls, *, kind=1):
        return super().__new__(cls)


class Derived(Base):
    def __new__(cls):
        return super().__new__(cls, kind=2)


class Validator:
    def __get__(self, owner, cls=None):
        return "1.0"


class Meta:
    version: Validator = Validator()


class Rules:
    def make_rules():
        return [1, 2]
    table = make_rules()


def advance(steps: list[str]) -> bool:
    for step in steps:
        if step == "x":
            raise ValueError(step)
    else:
        return True


def pick(option: int | str) -> int:
    match option:
        case int():
            return option
        case str():
            return len(option)


class special:
    def __init__(self, function):
        self.function = function

    def __getitem__(self, item):
        return item


@special
def Either(self, parameters):
    return parameters


class Lab(Behavior):
    def on_activate(self):
        self.extension = Extension()
        self.sign("abc", b"x")
        self.connect("http://x")
        version = Meta().version
        self.order = ["1.0", "2.0"].index(version)
        found = Either["a"]
        self.found = found
        advance(["a"])
        pick(3)
        longer(List([1]))
        self.newer = Later, tomllib
        Derived()

    def sign(self, name: str, data: bytes) -> bytes:
        name = name.encode("utf-8")
        return b"sha-" + name[-3:]

    def split(self, text: str) -> list[str]:
        text = text.split(",")
        text.append("x")
        return text

    def connect(self, uri: str):
        def factory(uri: Uri):
            return takes_uri(uri)
        for extension in [self.extension]:
            if hasattr(extension, "reset"):
                extension.reset()
        return factory(Uri(uri))

    async def later(self):
        pass

    def __await__(self):
        return self.later().__await__()
"""


def test_code_of_well_kept_packages_is_not_reported(tmp_path: Path) -> None:
    (tmp_path / "lab.py").write_text(CODE, encoding="utf-8")
    assert [item.message for item in diagnostics_in(SYSTEM, tmp_path)] == []
