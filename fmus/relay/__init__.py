"""The relay unit: which vehicle, if any, forwards the sharer's data to the ego."""

from fmus.relay.component import Direct as Direct, Mohed as Mohed
