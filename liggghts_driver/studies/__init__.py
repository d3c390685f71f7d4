"""Studies: one scene run many times, with one thing changed at a time."""
