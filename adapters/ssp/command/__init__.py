"""What the actions of `nlosim ssp` do."""
