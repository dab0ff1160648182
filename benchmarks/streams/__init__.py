"""Streams of a session, recorded and read."""
