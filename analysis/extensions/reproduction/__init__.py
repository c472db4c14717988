"""Published experiments computed anew: what documents print, beside what the shipped designs
give.
"""
