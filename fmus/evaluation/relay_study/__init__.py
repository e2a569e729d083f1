"""The comparison of relay policies: the paper's Table II and Figures 7 and 8, from all runs."""

from fmus.evaluation.relay_study.report import RelayStudy as RelayStudy
from fmus.evaluation.relay_study.sensitivity import RelaySensitivity as RelaySensitivity
