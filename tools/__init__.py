"""Generators of shipped files and of the documentation's pictures. Never installed; nothing imports them."""
