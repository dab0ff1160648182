"""Simulated sessions: twins of devices, virtual textures, recordings faster than real time, sets of textures."""
