"""A motion tracker: the position of a marker, its visibility and speed, and the opening of a door."""
