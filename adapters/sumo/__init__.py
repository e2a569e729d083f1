"""SUMO in this process, with an ego vehicle to be driven and an encounter at a red light."""

from adapters.sumo.component import SumoTraffic

__all__ = ["SumoTraffic"]
