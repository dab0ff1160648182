"""The accuracy of the door's simulated plant and its rendering: problems, other methods, a reference, pictures."""
