"""Force profiles of doors: their grid, features, limits and variants."""
