"""In-process delivery between the ports of one system.

Messages, requests and answers go straight from port to port, by reference. The DDS endpoints are
there all the same, and serve whoever is outside.
"""
