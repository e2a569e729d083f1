"""The page of an experiment: one file to look at all its runs, in a browser, offline."""
