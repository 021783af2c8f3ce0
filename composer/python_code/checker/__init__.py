"""Runs a type checker over copies of users' files and maps what it finds back.

The user's files stay as they are and need no annotations: in a copy, a behavior gets the base class
that its node type generates, and handlers and callbacks get annotated arguments.
"""
