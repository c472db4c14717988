"""From a design and its readings to estimates: blocks, elimination, Gauss-Newton, starting
values.
"""
