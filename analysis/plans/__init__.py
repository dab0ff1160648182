"""What is to be computed, declared before the data exist: the file analysis.yaml and what it may ask for."""
