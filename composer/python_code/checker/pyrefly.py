"""Runs pyrefly, a type checker from PyPI, in a process of its own under limits."""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Collection, Iterable, Mapping
from contextlib import ExitStack, suppress
from itertools import chain
from pathlib import Path
from typing import Any

from composer.base.fast_dataclass import dataclass
from composer.base.files import KeptResult
from composer.python_code.problems import CheckerFailed
from composer.python_code.stubs.folder import LIBRARIES

#: The kinds that may be mistakes; the others are about annotations and definitions.
_KINDS = (
    *("bad-argument-count", "bad-argument-type", "bad-assignment", "bad-context-manager"),
    *("bad-function-definition", "bad-index", "bad-keyword-argument", "bad-match", "bad-raise"),
    *("bad-return", "bad-unpacking", "invalid-argument", "invalid-syntax", "missing-argument"),
    *("missing-attribute", "missing-import", "missing-module-attribute", "no-matching-overload"),
    *("not-async", "not-callable", "not-iterable", "parse-error", "read-only", "regex"),
    *("unbound-name", "unexpected-keyword", "unknown-name", "unsupported-operation"),
    "unused-coroutine",
)
#: What the checker says about code that Python refuses to compile.
SYNTAX_KINDS = frozenset({"invalid-syntax", "parse-error"})
MISSING_RETURN = "missing an explicit `return`"
#: Kinds that are off by default and point to mistakes.
_OFF_BY_DEFAULT = (
    *("implicit-bool", "incompatible-comparison", "invalid-format-spec"),
    "unreachable-except-clause",
)
TIME_LIMIT_S = 60.0
#: The files that the checker writes.
_OUTPUTS = ("output.json", "errors.txt")
#: Seconds of processor time, and how many more for each megabyte. Usual code takes a tenth of it.
_CPU_S, _CPU_S_PER_MB = 10, 20
_LIMITS = {
    resource.RLIMIT_AS: 1_000_000_000,  # bytes; it maps about 400 MB and uses 60
    resource.RLIMIT_FSIZE: 16_000_000,
    resource.RLIMIT_CORE: 0,
}
#: The checker parses newer syntax than an old interpreter does.
PYTHON_VERSION = max(sys.version_info[:2], (3, 12))


@dataclass(frozen=True, slots=True)
class Finding:
    """What the checker says about a place in a file; lines and columns count from 1."""

    path: str
    line: int
    column: int
    end_line: int
    end_column: int
    kind: str
    message: str


@dataclass(slots=True)
class Run:
    """A run of the checker: a process in the background, unless its output is kept already."""

    _output: KeptResult
    _folder: tempfile.TemporaryDirectory[str] | None = None
    _process: subprocess.Popen[bytes] | None = None

    def findings(self) -> list[Finding]:
        """Wait for what the checker finds. Raises CheckerFailed."""
        if self._folder is None or self._process is None:
            return _findings(self._output.data or b"", b"", 0)
        try:
            self._process.wait(timeout=TIME_LIMIT_S)
            output, errors = (Path(self._folder.name, name).read_bytes() for name in _OUTPUTS)
        except subprocess.TimeoutExpired:
            raise CheckerFailed(f"it took longer than {TIME_LIMIT_S:.0f} s") from None
        except OSError as error:
            raise CheckerFailed(f"its output is lost: {error.strerror}") from None
        finally:
            self.close()
        found = _findings(output, errors, self._process.returncode)
        self._output.keep(output)
        return found

    def close(self) -> None:
        """End the process and remove its files."""
        if self._folder is None or self._process is None:
            return
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        self._folder.cleanup()


def start(files: Mapping[str, str], checked: Collection[str], search_paths: Iterable[str]) -> Run:
    """Start to check files, unless the same files have been checked before.

    ``checked`` are the files to report about, ``search_paths`` the folders to import from. All
    are relative to a private folder that the files are written into. Raises CheckerFailed.
    """
    options = [*_options(search_paths), "--", *checked]
    installed = (*map(Path, package_folders()), *LIBRARIES.rglob("*.pyi"))
    times = sorted(f"{path} {path.stat().st_mtime_ns}" for path in installed)
    kept = KeptResult("checks", (*options, *times, *chain.from_iterable(files.items())))
    if kept.data is not None:
        return Run(kept)
    command = [_program(), *options]
    try:
        folder = tempfile.TemporaryDirectory(prefix="compose-", ignore_cleanup_errors=True)
    except OSError as error:
        raise CheckerFailed(f"no temporary folder: {error.strerror}") from None
    try:
        process = _popen(command, Path(folder.name), files)
    except OSError as error:
        folder.cleanup()
        raise CheckerFailed(f"it cannot be started: {error.strerror}") from None
    size = sum(len(files[name]) for name in checked)
    _limit(process.pid, _CPU_S + _CPU_S_PER_MB * size // 1_000_000)
    return Run(kept, folder, process)


def _popen(command: list[str], root: Path, files: Mapping[str, str]) -> subprocess.Popen[bytes]:
    """Write the files into a folder, and start the checker in it. Raises OSError."""
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text.encode(errors="surrogateescape"))
    (root / "pyrefly.toml").touch()  # otherwise it looks for settings in the folders above
    with ExitStack() as stack:
        output, errors = (stack.enter_context((root / name).open("wb")) for name in _OUTPUTS)
        return subprocess.Popen(  # noqa: S603 (a program that is installed with the composer)
            command,
            cwd=root,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=errors,
            env=_environment(root),
        )


def _program() -> str:
    """Return the program that was installed with this Python."""
    installed = Path(sys.executable).with_name("pyrefly")
    found = str(installed) if installed.is_file() else shutil.which("pyrefly", path=os.defpath)
    if found is None:
        raise CheckerFailed("pyrefly is not installed: 'pip install pyrefly'")
    return found


def _options(search_paths: Iterable[str]) -> list[str]:
    version = ".".join(map(str, PYTHON_VERSION))
    # The interpreter is not asked for its paths: with the ros wheels it starts twice.
    options = ["check", "--output-format=json", "--summary=none", "--color=never", "--threads=2"]
    options += [f"--python-version={version}", "--skip-interpreter-query"]
    # A list that is empty at first may get publishers of several types.
    options += ["--infer-with-first-use=false"]
    options += ["--disable-search-path-heuristics=true", "--use-ignore-files=false"]
    options += [f"--only={kind}" for kind in (*_KINDS, *_OFF_BY_DEFAULT)]
    options += [f"--error={kind}" for kind in _OFF_BY_DEFAULT]
    options += [f"--search-path={path}" for path in search_paths]
    return [*options, *(f"--site-package-path={path}" for path in package_folders())]


def package_folders() -> list[str]:
    """Return the folders of installed packages."""
    return [path for path in sys.path if path.endswith("-packages") and Path(path).is_dir()]


def _environment(root: Path) -> dict[str, str]:
    """Return the environment of the checker: nothing of the user's settings."""
    return {"HOME": str(root), "PATH": os.defpath, "LANG": "C.UTF-8", "TMPDIR": str(root)}


def _limit(process: int, cpu_s: int) -> None:
    """Limit what a process may use, where the operating system can."""
    if hasattr(resource, "prlimit"):
        with suppress(OSError):  # it may have ended
            # SIGXCPU comes at the first limit, SIGKILL at the second.
            resource.prlimit(process, resource.RLIMIT_CPU, (cpu_s, cpu_s + 1))
            for kind, limit in _LIMITS.items():
                resource.prlimit(process, kind, (limit, limit))


def _findings(output: bytes, errors: bytes, code: int) -> list[Finding]:
    """Return what the checker has printed. Raises CheckerFailed."""
    if code == -signal.SIGXCPU:
        raise CheckerFailed("it needed too much processor time")
    if code < 0:
        raise CheckerFailed(f"it was ended by {signal.Signals(-code).name}")
    names = ("path", "line", "column", "stop_line", "stop_column", "name", "description")
    try:
        reported: list[dict[str, Any]] = json.loads(output)["errors"]
        certain = (item for item in reported if item["severity"] in ("error", "warn"))
        return [Finding(*(item[name] for name in names)) for item in certain]
    except (ValueError, KeyError, TypeError, RecursionError):
        lines = errors.decode(errors="replace").strip().splitlines()
        reason = lines[-1][:200] if lines else f"exit code {code}, and no output of the known form"
        raise CheckerFailed(f"it failed: {reason}") from None
