"""Errors beside times on the same inputs, of each part and of other libraries. Never installed; nothing imports it."""
