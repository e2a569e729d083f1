"""Campaigns: runs that take hours and may be interrupted, of an experiment or a training."""
