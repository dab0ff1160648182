"""The page of an evaluation: words, tables and figures as blocks, and the one HTML file that they become."""
