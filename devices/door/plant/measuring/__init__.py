"""How well the plant computes and renders, for bench and tests: problems, other methods, a reference, pictures."""
