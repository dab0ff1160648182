"""Perceptual spaces: components of ratings, maps of distances, comparisons of maps, and adjectives in them."""
