"""Features, data sets, networks, training and export of trained models. Nothing is trained yet: this room is empty."""
