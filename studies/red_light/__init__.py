"""Evaluation of a run of the red-light study: metrics, a summary, one figure."""

from studies.red_light.report import RedLightReport as RedLightReport
