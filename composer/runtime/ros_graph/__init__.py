"""The ROS graph as a node has discovered it: nodes, endpoints, and changes of them."""
