"""The statistics that a plan may ask for, a family in two files: what it may say, and its answers."""
