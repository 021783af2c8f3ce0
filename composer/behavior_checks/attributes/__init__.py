"""Attributes that do not exist, are misspelled, or change their type."""
