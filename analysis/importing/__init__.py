"""Import of foreign tables of ratings by a column map."""
