"""Sound: an output of a sound card, and the noise that masks the sounds of devices."""
