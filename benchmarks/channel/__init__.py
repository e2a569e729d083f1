"""The channel beside Veins: the same vehicles, packets and models."""

from benchmarks.channel.benchmark import ChannelBenchmark as ChannelBenchmark
