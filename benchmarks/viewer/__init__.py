"""The page of a run in a browser: how soon it is there, how it plays, what following costs."""

from benchmarks.viewer.benchmark import PageBenchmark as PageBenchmark
