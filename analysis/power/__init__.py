"""How many participants an effect needs: simulated people through the real runner, the plan's own test at the end."""
