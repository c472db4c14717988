"""What is to be read: positions chosen from a pool, the order to read them in, the design as a
file, and its repair.
"""
