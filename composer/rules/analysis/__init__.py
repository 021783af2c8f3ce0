"""What several rules compute: rates, delays, unconnected ports, parameter values."""
