"""From raw ledgers to every number, table and figure of an analysis plan, with the same bytes each time."""
