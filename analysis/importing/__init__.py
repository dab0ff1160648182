"""Foreign tables of ratings, read by a column map."""
