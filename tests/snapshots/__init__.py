"""What users see, word by word: a change of the house must change none of it unasked."""
