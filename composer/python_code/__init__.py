"""Users' Python: behaviors and rclpy classes, read and checked but never run.

``source`` reads files as syntax, ``nodes`` finds the classes and handlers of a system, ``stubs``
writes type stubs, ``checker`` runs the type checker, and ``checks`` has what only we can know.
"""
