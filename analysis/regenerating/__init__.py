"""From raw ledgers to every number, table and figure that an analysis plan asks for, and the same bytes each time."""
