"""A stylus on a tablet: its position, its speed and its force."""
