"""Sessions with a participant, at real devices or at simulated ones in their place: opened, composed and closed."""
