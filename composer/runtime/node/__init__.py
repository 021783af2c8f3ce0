"""The lifecycle node: its entities, its behavior, its parameters, and rcl's state machine."""
