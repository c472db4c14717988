"""Experiment files: loading them, what they may say, and the messages about what is wrong with
them.
"""
