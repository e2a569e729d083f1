"""Compares the perception FMU with geometry: `nlosim verify perception`."""
