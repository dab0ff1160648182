"""Error against run time: measured rows, their table and their plot."""
