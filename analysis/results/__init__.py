"""Results that show themselves, and how they are written."""
