"""Driving networks: encoder, messages of keypoints, fusion and head, in NumPy."""
