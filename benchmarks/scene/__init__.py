"""A city full of radios: how fast it runs, and what it takes."""

from benchmarks.scene.benchmark import SceneBenchmark as SceneBenchmark
