"""The experimenter's console: what stands on it, what its keys mean, and where it is drawn."""
