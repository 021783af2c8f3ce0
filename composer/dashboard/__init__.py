"""The dashboard: a web server that shows and controls running systems in the browser.

It is a process of its own, so that its work never shares an interpreter lock with nodes. ``web``
has the server with its routes and a connection for each browser, ``access`` decides about each
request. ``channels`` are what a browser can subscribe to and ``operations`` what it can request;
both see the ROS graph through ``observing``, which ``ros_side`` starts only while a browser is
connected. ``foxglove`` is the protocol of Foxglove, on the same port.
"""
