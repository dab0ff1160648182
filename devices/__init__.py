"""Everything that touches the participant or the stimulus, and a simulated twin of each."""
