"""The runtime's kernel in C, and what opens it."""
