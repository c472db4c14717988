"""Reliability in the sense of Baarda: which biases of the observations would be noticed, and what
the others do.
"""
