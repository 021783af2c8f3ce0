"""Running systems of the composer: what their managers report, and requests to them."""
