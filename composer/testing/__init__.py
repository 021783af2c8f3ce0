"""Tests of systems and behaviors, in time that the test controls."""
