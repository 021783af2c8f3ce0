"""Interfaces and the values of their fields."""
