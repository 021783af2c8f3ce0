"""Interoperation with ``launch`` and ``launch_ros``, which are optional.

``from composer.launch.actions import ComposeSystem`` is an action for launch files.
:mod:`.visitor` reads launch files, in a process of its own.
"""
