"""Perceptual spaces: components of ratings, maps of distances, maps compared, and adjectives in them."""
