"""Repeating a run from its manifest, on any machine."""
