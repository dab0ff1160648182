"""A motion tracker: where a marker is, when it was seen, how fast it moves, and how far a door is open."""
