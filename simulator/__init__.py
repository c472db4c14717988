"""Designs, readings and estimates of ball-plate experiments for co-ordinate measuring machines."""
