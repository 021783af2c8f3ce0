"""What commands, managers and processes of a system send each other: dataclasses, as JSON.

``reports`` and ``requests`` are the dataclasses, ``codec`` is their only way to JSON and back.

==============================  ==========================  =======================================
from and to                     carrier                     content
==============================  ==========================  =======================================
command to manager, same host   Unix socket                 queries of ``requests``, and answers
command to manager, any host    service ``request``         ``Restart``, and ``Done``
coordinating process to others  service ``request``         ``ChangeStates``, ``AskReportKey``, and
                                                            answers
manager to all                  topic ``state``, latched    ``SystemReport``, signed if another
                                                            process moves the nodes
manager to all                  topic ``callbacks``         ``TimingReport``
manager to other instances      service ``_instance_...``   ``Instance``
==============================  ==========================  =======================================

What tools of ROS use is ordinary ROS: ``/diagnostics``, parameters, lifecycle services, and the
services ``startup``, ``pause``, ``resume``, ``reset``, ``shutdown`` and ``is_active``.
"""
