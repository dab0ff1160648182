"""Features, data sets, networks, training, evaluation and export of trained models."""
