"""Changes after which a design determines all that it asks for: what can be changed, and what of it
is cheapest.
"""
