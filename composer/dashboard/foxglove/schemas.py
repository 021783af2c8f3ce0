"""Definitions of messages as clients read them: a message and everything in it, in one text."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from composer.interfaces import FieldType, Interfaces, Message, Service
from composer.language.tree import Plain

_SEPARATOR = "=" * 80
_MAX_SCHEMAS = 10_000


class Schemas:
    """Makes schemas from the definitions of interfaces; each is made once."""

    def __init__(self, interfaces: Interfaces) -> None:
        self._interfaces = interfaces
        self._messages: dict[str, str | None] = {}
        self._services: dict[str, tuple[str, str] | None] = {}

    def message(self, name: str) -> str | None:
        """Return the schema of a message; None if a definition is not known."""
        if name not in self._messages:
            _make_room(self._messages)
            found = self._interfaces.message(name)
            self._messages[name] = None if found is None else self._text(found)
        return self._messages[name]

    def service(self, name: str) -> tuple[str, str] | None:
        """Return the schemas of the request and the response of a service, or None."""
        if name not in self._services:
            _make_room(self._services)
            self._services[name] = self._service(name)
        return self._services[name]

    def _service(self, name: str) -> tuple[str, str] | None:
        found = self._interfaces.find(name)
        if not isinstance(found, Service):
            return None
        request, response = self._text(found.request), self._text(found.response)
        return None if request is None or response is None else (request, response)

    def _text(self, message: Message) -> str | None:
        inner: dict[str, Message] = {}
        pending = [message]
        while pending:
            for field in pending.pop().fields:
                name = field.type.name
                if field.type.is_primitive or name in inner:
                    continue
                found = self._interfaces.message(name)
                if found is None:
                    return None
                inner[name] = found
                pending.append(found)
        parts = [_definition(message)]
        parts += [f"MSG: {_short(name)}\n{_definition(found)}" for name, found in inner.items()]
        return f"{_SEPARATOR}\n".join(parts)


def _make_room(schemas: dict[str, Any]) -> None:
    """Forget schemas if there are too many: any node can announce names of types."""
    if len(schemas) >= _MAX_SCHEMAS:
        schemas.clear()


def _definition(message: Message) -> str:
    return "".join(f"{line}\n" for line in _lines(message))


def _lines(message: Message) -> Iterator[str]:
    # With full names: clients look for a relative one in all packages.
    for constant in message.constants:
        yield f"{constant.type} {constant.name}={_literal(constant.value)}"
    for field in message.fields:
        default = "" if field.default is None else f" {_literal(field.default)}"
        yield f"{_type(field.type)} {field.name}{default}"


def _type(type_: FieldType) -> str:
    return str(type_) if type_.is_primitive else str(type_).replace(type_.name, _short(type_.name))


def _short(name: str) -> str:
    """Return ``package/Name`` for ``package/msg/Name``."""
    package, _, last = name.split("/")
    return f"{package}/{last}"


def _literal(value: Plain) -> str:
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_literal, value))}]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    return str(value).lower() if isinstance(value, bool) else str(value)
