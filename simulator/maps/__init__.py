"""Fitted maps of machines: estimated errors with their covariance, and what follows from them."""
