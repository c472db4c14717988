"""Families of experiments: what varies, the store of what came out, and the work spread over
processes.
"""
