"""The verdict of a fit that its map keeps, and what is kept of the campaign of an earlier map."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
