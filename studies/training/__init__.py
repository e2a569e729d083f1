"""Training of driving policies in the co-simulation: behaviour cloning, then DAgger."""
