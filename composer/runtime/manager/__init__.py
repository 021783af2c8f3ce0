"""The manager node: the services and topics of a system as a whole."""
