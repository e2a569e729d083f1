"""The page of a run: one file to look at, in a browser, offline."""
