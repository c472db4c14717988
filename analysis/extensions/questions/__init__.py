"""What an estimate takes for granted, asked of its readings."""
