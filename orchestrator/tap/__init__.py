"""Looking at the signals of a run that goes on."""
