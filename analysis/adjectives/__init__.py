"""Which adjectives describe the stimuli: relevance, antonyms, agreement on words, a lexicon of free words."""
