"""Many synthetic data sets of one true machine, each estimated in full, a batch of them at a
time.
"""
