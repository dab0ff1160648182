"""Streams: from the threads that read sensors to the ledger, with every loss recorded."""
