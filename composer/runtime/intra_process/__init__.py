"""In-process delivery between the ports of one system.

Messages, requests and responses pass from port to port by reference. The DDS endpoints exist
as well and serve other processes.
"""
