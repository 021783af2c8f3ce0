"""What a type checker cannot find in users' Python: values, callbacks, and uses of the API."""
