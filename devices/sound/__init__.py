"""Sound: an output of a sound card, and the noise that masks what a device can be heard to do."""
