"""What several rules compute: rates, wiring, periods, publications, parameter values."""
