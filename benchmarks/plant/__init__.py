"""How well the door's simulated plant computes and renders: problems, other methods, a reference, pictures."""
