"""Ball co-ordinates: on the artefact, and in the machine for each of its positions."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
