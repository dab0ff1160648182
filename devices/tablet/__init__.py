"""A stylus on a tablet: where it is, how fast it goes and how hard it presses."""
