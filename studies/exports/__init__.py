"""`nlosim export` and `nlosim view`: a run in the formats that other tools read."""
