"""What it takes processes to exchange values: ours beside HELICS, mosaik and bare loops."""

from benchmarks.distributed.benchmark import DistributedBenchmark as DistributedBenchmark
