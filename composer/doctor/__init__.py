"""What keeps a ROS 2 system from working, outside of its files, and what to do about it.

``environment``, ``network``, ``versions`` and ``interfaces`` import no rclpy: they are looked at
where it is missing, too. ``graph`` joins the ROS graph.
"""
