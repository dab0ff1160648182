"""Analysis plans, declared before the data exist: the file analysis.yaml and what it may contain."""
