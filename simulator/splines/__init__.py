"""Least-squares splines with prescribed values and slopes: spaces, constraints, fits, pieces for a
controller.
"""
