"""Uncertainties of lengths over the whole volume."""
