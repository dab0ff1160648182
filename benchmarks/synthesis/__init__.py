"""A texture model's step in each runtime, its training, and its free running."""
