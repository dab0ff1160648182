"""Textures to be felt: models that continue an acceleration for a hand's speed and force (thesis 4)."""
