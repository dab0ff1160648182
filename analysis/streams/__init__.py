"""Recorded streams: their contents in a session's ledger, and their export."""
