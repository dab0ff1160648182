"""Textures that can be described: predicted attributes from touch and sight (thesis 3)."""
