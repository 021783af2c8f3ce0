"""From text to one tree of values with their places: YAML, JSON Schemas, variables, expressions."""
