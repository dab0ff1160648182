"""Sessions and their ledgers: written, read, resumed, replayed, and turned into plain rows."""
