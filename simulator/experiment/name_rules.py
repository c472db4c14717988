"""Rules by which measuring programs name features: a name with fields in braces, such as
{position}_{ball}_{probe}, and * for anything.
"""

from __future__ import annotations

import re

from ballplate.simulator.inputs.settings import shorten

PLACES = ("position", "ball", "probe", "run")
PLACE = re.compile(r"\{([^{}]*)\}")


def check_rule(rule: str) -> str:
    """Return a valid rule.

    :raises ValueError: it has no ball, or an unknown or repeated field.
    """
    place_holders = PLACE.findall(rule)
    unknown = [name for name in place_holders if name not in PLACES]
    if unknown or "{" in PLACE.sub("", rule) or "}" in PLACE.sub("", rule):
        subject = f'"{shorten(unknown[0])}"' if unknown else "a brace without its other one"
        raise ValueError(f"{subject} in a rule of names; known: {', '.join(PLACES)}, in braces")
    if "ball" not in place_holders or len(set(place_holders)) < len(place_holders):
        raise ValueError(f'"{shorten(rule)}" needs {{ball}}, and each place at most once')
    return rule
