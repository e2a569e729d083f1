"""What it takes processes to exchange values: ours beside HELICS, mosaik and bare loops."""
