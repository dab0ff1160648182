"""Prediction of textures' attributes from touch and sight (thesis 3)."""
