"""Reliability in the sense of Baarda: biases of observations that a test finds, and the effects
of those that it does not find.
"""
