"""Driving policies in every encounter, and in variations that networks were not trained in."""

from studies.generalisation.report import Generalisation

__all__ = ["Generalisation"]
