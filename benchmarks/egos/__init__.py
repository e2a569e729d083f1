"""Several ego vehicles in one run: what each further one costs."""

from benchmarks.egos.benchmark import EgosBenchmark as EgosBenchmark
