"""Errors and uncertainties along curves, axes and through the volume."""
