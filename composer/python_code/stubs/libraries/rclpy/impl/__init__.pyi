from rclpy.impl import implementation_singleton as implementation_singleton
from rclpy.impl import logging_severity as logging_severity
from rclpy.impl import rcutils_logger as rcutils_logger
