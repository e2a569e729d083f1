"""Scenario files: YAML text in, a checked `Scenario` and its components out."""
