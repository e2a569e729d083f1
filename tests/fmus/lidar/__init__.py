"""Tests of the lidar FMU."""
