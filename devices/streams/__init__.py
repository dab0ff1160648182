"""Streams: from the threads that read sensors to the ledger, with nothing lost unsaid."""
