"""Runs that go on where they were cut off: their checkpoints, and what is made of them."""
