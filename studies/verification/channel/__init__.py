"""Compares the channel FMU with golden data: `nlosim verify channel`."""
