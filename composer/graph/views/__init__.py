"""One file for each way to look at a system: ``build(system, diagnostics) -> Graph``."""
