"""Files as text, numbers with units, and messages about errors in them; independent of ball
plates.
"""
