"""Draws the figures of the manual again, from the tables beside them: `python -m studies.figures`.

Measuring takes hours, drawing seconds: no number changes.
"""
