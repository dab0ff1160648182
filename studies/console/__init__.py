"""The experimenter's console: what it shows, what its keys mean, and where it is drawn."""
