"""Diagrams of systems and of running ROS graphs.

Systems (``declared``) or a snapshot of a ROS graph (``live``) become a scene, a view
(``channel_views``, ``node_views``) turns a scene into a graph, and ``output`` writes the graph in a
format.
"""
