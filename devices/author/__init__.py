"""The designer's window: seven wishes on sliders, and the door that they make, drawn and played at once."""
