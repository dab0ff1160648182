"""A library of textures to search by feel (thesis 1.2)."""
