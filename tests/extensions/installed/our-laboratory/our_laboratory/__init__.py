"""What our laboratory adds to ballplate."""

from ballplate import Extension

EXTENSION = Extension(
    "our_laboratory",
    "our_laboratory",
    # Each name, with the module below our_laboratory that has it.
    artefacts={"step_gauge": "step_gauge", "ring": "ring", "twins": "twins"},
    calibrations={"laser": "laser", "flatness": "flatness", "corner": "corner"},
    error_models={"stretched": "stretched"},
    influences={"styli": "styli"},
    quantities={"U7": "diagonals"},
    sections={"climate": "climate"},
)
