"""What a prediction takes for granted, and U6 where that does not hold."""
