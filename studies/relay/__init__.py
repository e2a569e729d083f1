"""The comparison of relay policies: the paper's Table II and Figures 7 and 8, from all runs."""

from studies.relay.readings import RelayReadings as RelayReadings
from studies.relay.report import RelayStudy as RelayStudy
from studies.relay.sensitivity import RelaySensitivity as RelaySensitivity
