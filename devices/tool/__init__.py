"""The sensorised tool that a textured surface is explored with (thesis 3.4.1, 4.3.1)."""
