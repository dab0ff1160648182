"""The sample stage, and the check that the right sample lies on it."""
