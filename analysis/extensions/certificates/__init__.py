"""Certificates of plates: what a fit says of their balls, in forms that others can use."""
