"""Traffic replayed from a file: SUMO's floating car data, or a table of positions over time."""

from adapters.replay.component import FcdReplay

__all__ = ["FcdReplay"]
