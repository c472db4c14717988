"""Null directions of a design, and their description in words."""
