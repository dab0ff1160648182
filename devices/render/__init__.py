"""Play a texture in real time: a hand's speed and force in, a vibration at 1 kHz out (thesis 4.5)."""
