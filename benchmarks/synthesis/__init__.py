"""A texture model's step in each runtime, its training, and how it runs free."""
