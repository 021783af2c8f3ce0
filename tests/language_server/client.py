"""A client of language servers, as editors are: JSON-RPC over standard input and output."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

CURSOR = "|"
_ERROR = 1
_CAPABILITIES = {
    "textDocument": {
        "completion": {"completionItem": {"documentationFormat": ["markdown"]}},
        "hover": {"contentFormat": ["plaintext"]},
    },
    "workspace": {"configuration": True},
}
#: The settings of yaml-language-server, by section.
_YAML = {"validate": True, "hover": True, "completion": True, "schemaStore": {"enable": False}}


@dataclass(frozen=True, slots=True)
class Cursor:
    """A position in an open document. The line and the character count from 0."""

    uri: str
    line: int
    character: int

    def as_parameters(self) -> dict[str, Any]:
        """Return the parameters of a request at this position."""
        position = {"line": self.line, "character": self.character}
        return {"textDocument": {"uri": self.uri}, "position": position}


class LanguageServer:
    """A running language server."""

    def __init__(
        self, program: Path, root: Path | None = None, settings: Mapping[str, Any] | None = None
    ) -> None:
        """Start the server in a workspace, with its settings by section."""
        self._settings = {"yaml": _YAML} if settings is None else settings
        self._process = subprocess.Popen(
            ["node", str(program), "--stdio"], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        self._requests = 0
        self._documents = 0
        self._diagnostics: dict[str, list[dict[str, Any]]] = {}
        uri = None if root is None else root.as_uri()
        folders = [] if root is None else [{"uri": uri, "name": root.name}]
        parameters = {
            "processId": None,
            "rootUri": uri,
            "workspaceFolders": folders,
            "capabilities": _CAPABILITIES,
        }
        self._request("initialize", parameters)
        self._notify("initialized", {})

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()

    def open(self, text: str, schema: Path) -> Cursor:
        """Open a document with a schema; return the position of ``|``, which is not part of it."""
        self._documents += 1
        uri = f"file:///test/{self._documents}.yaml"
        text = f"# yaml-language-server: $schema={schema.as_uri()}\n{text}"
        return self._open(uri, "yaml", text)

    def open_python(self, path: Path, text: str) -> Cursor:
        """Open a Python file with this text; return the position of ``|``."""
        return self._open(path.as_uri(), "python", text)

    def _open(self, uri: str, language: str, text: str) -> Cursor:
        before, _, after = text.partition(CURSOR)
        document = {"uri": uri, "languageId": language, "version": 1, "text": before + after}
        self._notify("textDocument/didOpen", {"textDocument": document})
        return Cursor(uri, before.count("\n"), len(before.rpartition("\n")[2]))

    def complete(self, cursor: Cursor) -> dict[str, str]:
        """Return what the server offers, with the documentation of each."""
        found = self._request("textDocument/completion", cursor.as_parameters())
        return {item["label"]: str(item.get("documentation", "")) for item in found["items"]}

    def hover(self, cursor: Cursor) -> str:
        """Return the text that the server shows for a key or value; empty if there is none."""
        found = self._request("textDocument/hover", cursor.as_parameters())
        return str(found["contents"]["value"]) if found else ""

    def diagnostics(self, cursor: Cursor) -> list[str]:
        """Wait for the diagnostics of a document, and return their messages."""
        return [item["message"] for item in self.awaited_diagnostics(cursor)]

    def errors(self, cursor: Cursor) -> dict[int, str]:
        """Wait for the diagnostics of a document; return the errors by line, counted from 1."""
        return {
            item["range"]["start"]["line"] + 1: item["message"]
            for item in self.awaited_diagnostics(cursor)
            if item["severity"] == _ERROR
        }

    def awaited_diagnostics(self, cursor: Cursor) -> list[dict[str, Any]]:
        """Wait for the diagnostics of a document, and return them."""
        while cursor.uri not in self._diagnostics:
            self._handle(self._receive())
        return self._diagnostics[cursor.uri]

    def _request(self, method: str, parameters: dict[str, Any]) -> Any:
        self._requests += 1
        self._send({"id": self._requests, "method": method, "params": parameters})
        while True:
            message = self._receive()
            if message.get("id") == self._requests and "method" not in message:
                return message["result"]
            self._handle(message)

    def _notify(self, method: str, parameters: dict[str, Any]) -> None:
        self._send({"method": method, "params": parameters})

    def _handle(self, message: dict[str, Any]) -> None:
        """Handle a request or notification of the server."""
        match message.get("method"):
            case "workspace/configuration":
                items = message["params"]["items"]
                found = [self._settings.get(item.get("section"), {}) for item in items]
                self._send({"id": message["id"], "result": found})
            case "textDocument/publishDiagnostics":
                self._diagnostics[message["params"]["uri"]] = message["params"]["diagnostics"]
            case str() if "id" in message:
                self._send({"id": message["id"], "result": None})

    def _send(self, message: dict[str, Any]) -> None:
        assert self._process.stdin is not None
        content = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self._process.stdin.write(b"Content-Length: %d\r\n\r\n%s" % (len(content), content))
        self._process.stdin.flush()

    def _receive(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        length = 0
        while line := self._process.stdout.readline().strip():
            name, _, value = line.partition(b":")
            if name.lower() == b"content-length":
                length = int(value)
        assert length, "the language server has ended"
        message: dict[str, Any] = json.loads(self._process.stdout.read(length))
        return message
