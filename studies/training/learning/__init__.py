"""Learning of driving networks from samples, with PyTorch."""
