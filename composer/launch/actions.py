"""Actions for launch files. Needs the package ``launch``.

::

    from composer.launch.actions import ComposeSystem

    ComposeSystem(system="systems/robot.yaml", namespace=LaunchConfiguration("namespace"))

In XML and YAML launch files, the action is called ``compose_system``.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Mapping
from typing import Any

from launch.actions import ExecuteProcess
from launch.frontend import Entity, Parser, expose_action
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions

#: Set by PushRosNamespace of launch_ros.
_ROS_NAMESPACE = "ros_namespace"
_TRUE = ("true", "1", "yes", "on")
#: Attributes in XML and YAML, and the arguments that they set.
_TEXTS = ("namespace", "use_sim_time", "log_level", "autostart")


@expose_action("compose_system")
class ComposeSystem(ExecuteProcess):  # type: ignore[misc]  # launch has no types
    """Runs a system, as ``compose run`` does, in a process of its own.

    The process gets the signals of ``ros2 launch``, and shuts the system down in order, also when
    the launch itself is killed. If the system fails, its exit code is 1: use ``on_exit`` to react
    to its end.
    """

    def __init__(  # noqa: PLR0913 - the arguments of the action
        self,
        *,
        system: Any,
        namespace: Any = "",
        use_sim_time: Any = "",
        log_level: Any = "",
        autostart: Any = "",
        parameters: Mapping[str, Any] | None = None,
        arguments: Iterable[Any] = (),
        **options: Any,
    ) -> None:
        """Run ``system``: a file, or the name of a system of an installed package.

        All arguments may be substitutions; empty ones are ignored. ``namespace`` is that of the
        system, below the namespaces that PushRosNamespace has set. ``use_sim_time`` is a boolean.
        ``parameters`` are values by ``node.parameter``, ``arguments`` further ones of
        ``compose run``, and ``options`` those of :class:`launch.actions.ExecuteProcess`.
        """
        options.setdefault("name", "compose")
        options.setdefault("output", "screen")
        python = (sys.executable, "-P", "-m", "composer.launch.child", str(os.getpid()))
        command = [*python, "run", system]
        super().__init__(cmd=command, **options)
        self._given = {
            "namespace": namespace,
            "use_sim_time": use_sim_time,
            "log_level": log_level,
            "autostart": autostart,
        }
        self._parameters = dict(parameters or {})
        self._arguments = list(arguments)
        self._is_complete = False

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[ComposeSystem], dict[str, Any]]:
        """Return the class and its arguments from XML or YAML."""
        _, options = super().parse(entity, parser, ignore=["cmd"])
        options["system"] = parser.parse_substitution(entity.get_attr("system"))
        for name in _TEXTS:
            text = entity.get_attr(name, optional=True)
            if text is not None:
                options[name] = parser.parse_substitution(str(text))
        return cls, options

    def execute(self, context: Any) -> Any:
        """Complete the command line, and start the process."""
        if not self._is_complete:
            self._is_complete = True
            words = self._options(context)
            self.cmd.extend(normalize_to_list_of_substitutions(word) for word in words)
        return super().execute(context)

    def _options(self, context: Any) -> list[str]:
        def text(value: Any) -> str:
            if isinstance(value, bool | int | float):
                return str(value).lower()
            return str(perform_substitutions(context, normalize_to_list_of_substitutions(value)))

        namespace = _below(
            context.launch_configurations.get(_ROS_NAMESPACE, ""), text(self._given["namespace"])
        )
        words = ["--namespace", namespace] if namespace else []
        if text(self._given["use_sim_time"]).lower() in _TRUE:
            words.append("--use-sim-time")
        for name in ("log_level", "autostart"):
            value = text(self._given[name])
            words += [f"--{name.replace('_', '-')}", value] if value else []
        for name, value in self._parameters.items():
            words += ["--set", f"{name}={text(value)}"]
        return words + [text(argument) for argument in self._arguments]


def _below(outer: str, inner: str) -> str:
    """Return a namespace below another one; an absolute one is returned as it is."""
    if not outer or inner.startswith("/"):
        return inner
    return f"{outer.rstrip('/')}/{inner}".rstrip("/")
