"""The types of values in Python behaviors.

The types come from the node that uses the behavior, from the definitions of messages, and from the
API in :mod:`composer.behavior`. A value whose type depends on more than that has an unknown type.
"""
