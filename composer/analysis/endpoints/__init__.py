"""Which ports belong together: by their names, types and QoS."""
