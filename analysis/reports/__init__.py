"""The report kit: tables, blocks and pages, whatever a report is of."""
