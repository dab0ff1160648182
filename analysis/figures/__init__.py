"""Every figure: its data table, and how it is drawn from that table alone."""
