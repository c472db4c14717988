"""Uncertainties of anything that the parameters determine."""
