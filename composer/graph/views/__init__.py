"""One module per view of a system: ``build(system, diagnostics) -> Graph``."""
