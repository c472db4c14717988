"""Machines from files: described errors, measured curves, and maps of fits, which are written and
loaded here; as true machines, error models, corrections of a controller and prior knowledge.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
