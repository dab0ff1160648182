"""Recorded streams: what a session's ledger holds of them, and their export."""
