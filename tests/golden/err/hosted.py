"""rclpy node classes for the rules about 'class'."""

import threading
import time

import rclpy
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from std_srvs.srv import Trigger


class Talker(Node):
    def __init__(self, prefix="hello"):
        super().__init__("talker")
        threading.Thread(target=lambda: rclpy.spin(self)).start()


class Managed(LifecycleNode):
    pass


class Lidar(Node):
    def __init__(self, port, *, rate):
        super().__init__("lidar")


class Plain:
    def on_tick(self):
        pass


class Spins(Node):
    def __init__(self):
        super().__init__("spins")
        rclpy.spin(self)


class Pair(Node):
    def __init__(self):
        super().__init__("pair")
        self.helper = rclpy.create_node("helper")

    def later(self):
        self.other = Node("other")


class Own(Node):
    def __init__(self):
        super().__init__("own", context=rclpy.Context(), cli_args=None)


class Sleeper(Node):
    def __init__(self):
        super().__init__("sleeper")
        self.name = input("name: ")
        self.client = self.create_client(Trigger, "x")

    def tick(self):
        time.sleep(0.5)
        self.client.call(Trigger.Request())


class Waiter(Node):
    def __init__(self):
        super().__init__("waiter")
        self.client = self.create_client(Trigger, "x")
        rclpy.spin_until_future_complete(self, self.client.call_async(Trigger.Request()))
