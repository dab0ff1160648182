"""A texture played sample by sample: the model on its own output, with its limits."""
