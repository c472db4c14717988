"""Files as text, numbers with units, and what is wrong with them; nothing of ball plates."""
