"""The people of a lab: pseudonyms, rows of the square, identities kept apart, questions and consent."""
