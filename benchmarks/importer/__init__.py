"""What importers add to FMUs that cost next to nothing: ours beside FMPy, ecos and a C loop."""

from benchmarks.importer.benchmark import ImporterBenchmark as ImporterBenchmark
