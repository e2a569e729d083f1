"""The lidar beside Embree: the same scenes, sensors and rays."""

from benchmarks.lidar.benchmark import LidarBenchmark as LidarBenchmark
