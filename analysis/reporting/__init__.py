"""From ratings to tests, figures, files and one HTML report."""
