"""What Python files say, read without types: names, bindings, classes and their attributes."""
