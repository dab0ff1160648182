"""The car door: force profiles over the opening angle, how they are made, and the door's simulated twin.

Nothing is imported here: `twin` and `grid` need no numpy, the others do.
"""
