"""The people of a lab: pseudonyms, rows of the square, identities stored apart, questions and consent."""
