"""Alternative estimators, and how far they are from the full one: of distances, by reversal, by
length equations.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
