"""Hosting: unmodified rclpy node classes as nodes of a running system.

The user's class gets a base class of the composer between itself and rclpy's ``Node``. So
``super().__init__('name')`` adopts the ROS node that exists in every lifecycle state instead of
creating one, and each publisher, subscription, service, client, action and timer that the class
creates becomes a port: gated by the lifecycle state, measured, and part of in-process delivery.
See docs/decisions for the reasons.
"""
