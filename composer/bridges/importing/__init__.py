"""Describes existing nodes, and writes the descriptions as systems and node types.

A description comes from the ROS graph (:mod:`.live`), from the source of a class
(:mod:`.python_class`) or from a launch file (:mod:`composer.launch`). Nothing here imports
ROS or runs the code of users.
"""
