"""How much of each error's information goes with each position of a design."""
