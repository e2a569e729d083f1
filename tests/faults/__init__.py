"""Random faults in random runs: what becomes of the run, its recording and its processes."""
