"""Python behaviors: their classes, handlers and callbacks."""
