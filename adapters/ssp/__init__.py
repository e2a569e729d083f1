"""System Structure and Parameterization (SSP 1.0 and 2.0): scenarios from packages, and back."""
