"""Evaluation of a run of the red-light study: metrics, a summary, one figure."""

from fmus.evaluation.report import RedLightReport as RedLightReport
