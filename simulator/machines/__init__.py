"""Error models of machines, behind one protocol."""
