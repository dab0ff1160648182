"""A lab's own parts: found in the lab's folder and among installed packages, and imported once they are named."""
