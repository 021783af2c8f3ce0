"""The types of the expressions in a function."""
