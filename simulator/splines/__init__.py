"""Least-squares splines with prescribed values and slopes: spaces, constraints, fits, pieces for a
controller.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
