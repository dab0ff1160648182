"""Power by simulation: the participants that an effect needs, by simulated people, real runner and plan's test."""
