"""The dashboard: a web server that shows and controls running systems in the browser.

It is a process of its own, so that its work never shares an interpreter lock with nodes. ``server``
accepts connections, ``app`` has the routes, ``access`` decides about each request, ``connection``
answers the requests of one browser. ``channels`` are what a browser can subscribe to and
``operations`` what it can request; both use :mod:`composer.client` through ``ros_side``, which
joins the ROS graph only while a browser is connected.
"""
