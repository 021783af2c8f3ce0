"""A component container in Python, which answers as the containers of rclcpp_components do."""

from __future__ import annotations

import contextlib
import gc
import sys
import time
from typing import Any

import rclpy
from composition_interfaces.srv import ListNodes, LoadNode, UnloadNode
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import String

from tests.ros.programs.managed_driver import ManagedDriver


class Talker(Node):
    def __init__(self, **options: Any) -> None:
        super().__init__("talker", **options)
        text = self.declare_parameter("text", "hello").value
        words = self.create_publisher(String, "words", 10)
        self.create_timer(0.05, lambda: words.publish(String(data=text)))


class Camera(ManagedDriver):
    def __init__(self, **options: Any) -> None:
        super().__init__("camera", **options)

    def on_cleanup(self, state: Any) -> TransitionCallbackReturn:
        self.get_logger().info("cleaned up")
        return super().on_cleanup(state)


class Broken(Node):
    def __init__(self, **_: Any) -> None:
        raise RuntimeError("no camera is connected")


class Verbose(Node):
    def __init__(self, **_: Any) -> None:
        raise RuntimeError("no camera\n" * 1000)


class Slow(Talker):
    """Takes longer than a second, after which other requests are sent again."""

    def __init__(self, **options: Any) -> None:
        time.sleep(1.2)
        super().__init__(**options)


class Stubborn(Talker):
    """Keeps a name of its own."""

    def __init__(self, **options: Any) -> None:
        options.pop("cli_args")
        super().__init__(**options)


KINDS = (Talker, Camera, Broken, Verbose, Slow, Stubborn)
PLUGINS = {f"demo::{kind.__name__}": kind for kind in KINDS}


class Container(Node):
    def __init__(self, executor: SingleThreadedExecutor) -> None:
        super().__init__("container")
        self.nodes: dict[int, Node] = {}
        self.unloaded: list[Node] = []
        self.last_id = 0
        self.spinner = executor
        for kind, name, answer in (
            (LoadNode, "load_node", self.load),
            (UnloadNode, "unload_node", self.unload),
            (ListNodes, "list_nodes", self.list),
        ):
            self.create_service(kind, f"~/_container/{name}", answer)

    def load(self, request: Any, response: Any) -> Any:
        plugin = PLUGINS.get(request.plugin_name)
        if plugin is None or request.package_name != "demo":
            response.error_message = "Failed to find class with the requested plugin name."
            return response
        rules = [f"__node:={request.node_name}", f"__ns:={request.node_namespace}"]
        rules += request.remap_rules
        overrides = [Parameter.from_parameter_msg(item) for item in request.parameters]
        extra = [f"{item.name}={item.value.bool_value}" for item in request.extra_arguments]
        print(f"{request.node_name} {request.log_level} {' '.join(extra)}", flush=True)
        try:
            node = plugin(
                cli_args=["--ros-args", *(word for rule in rules for word in ("-r", rule))],
                use_global_arguments=False,
                parameter_overrides=overrides,
            )
        except Exception as error:
            response.error_message = f"Component constructor threw an exception: {error}"
            return response
        self.last_id += 1
        self.nodes[self.last_id] = node
        self.spinner.add_node(node)
        response.success = True
        response.unique_id = self.last_id
        response.full_node_name = node.get_fully_qualified_name()
        return response

    def unload(self, request: Any, response: Any) -> Any:
        node = self.nodes.pop(request.unique_id, None)
        if node is None:
            response.error_message = f"No node found with unique_id: {request.unique_id}"
            return response
        print(f"unloads {node.get_fully_qualified_name()}", flush=True)
        self.spinner.remove_node(node)
        self.unloaded.append(node)
        response.success = True
        return response

    def destroy_unloaded(self) -> None:
        """Destroy nodes that the executor no longer uses; lifecycle nodes are reference cycles."""
        while self.unloaded:
            self.unloaded.pop().destroy_node()
            gc.collect()

    def list(self, _: Any, response: Any) -> Any:
        response.unique_ids = list(self.nodes)
        response.full_node_names = [node.get_fully_qualified_name() for node in self.nodes.values()]
        return response


def main() -> None:
    rclpy.init(args=sys.argv)
    executor = SingleThreadedExecutor()
    container = Container(executor)
    executor.add_node(container)
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        while rclpy.ok():
            executor.spin_once(timeout_sec=0.02)
            container.destroy_unloaded()


if __name__ == "__main__":
    main()
