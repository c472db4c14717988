"""Uncertainties of quantities that the parameters determine."""
