"""Splines with prescribed values through measured errors."""
