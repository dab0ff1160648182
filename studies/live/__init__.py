"""Sessions with a participant, at real or simulated devices: opened, composed and closed."""
