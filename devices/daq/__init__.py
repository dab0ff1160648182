"""Analogue sensors on data acquisition cards: the card, its twin, and the sensors wired to it."""
