"""Users' Python: behaviors and rclpy classes, read and checked but never run.

``lookup`` finds classes and reads their files, ``nodes`` finds the handlers and parameters of a
system, ``stubs`` writes type stubs, ``checker`` runs the type checker, and ``checks`` has what only
we can know.
"""
