"""Experiments: a scenario run with many seeds and at every combination of levels of factors."""
