"""The report kit: tables, blocks and pages for any report."""
