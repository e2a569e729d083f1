"""Tests of the lidar in PyTorch."""
