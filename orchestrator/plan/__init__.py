"""Stepping FMUs without Python in between: the plan of a run, and its engine."""
