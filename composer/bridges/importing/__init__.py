"""Describes existing nodes, and writes the descriptions as systems and node types.

A description comes from the ROS graph (:mod:`.live`), from the source of a class
(:mod:`.python_class`) or from a launch file (:mod:`composer.launch`). Nothing here imports
ROS or runs the code of users.
"""

from composer.bridges.importing.found import FoundNode, FoundParameter, FoundPort, FoundSystem
from composer.bridges.importing.readable import readable
from composer.bridges.importing.writing import write_node_type, write_parameters, write_system

__all__ = [
    "FoundNode",
    "FoundParameter",
    "FoundPort",
    "FoundSystem",
    "readable",
    "write_node_type",
    "write_parameters",
    "write_system",
]
