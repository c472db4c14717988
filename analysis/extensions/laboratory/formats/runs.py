"""Runs of a program whose results are in one report: what is written beside features tells which
are of the same run, such as the number of a part or a serial number.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Hashable, Mapping, Sequence

# Names of what is different in each run. Anything else may differ within a run.
OF_RUNS = re.compile(
    r"(?:(?:inspection |mess|prüf)?plan|part|teile?|werkstück|ser(?:ial|ien)?|lfd|lauf(?:ende)?|"
    r"run|lot|charge|stats)[ _.-]*(?:id|nb|nr|no|num|number|nummer|name|count|sn|rv)?\.?|"
    r"filnam|measurementresults",
    re.IGNORECASE,
)


def runs_of(keys: Sequence[Hashable], marks: Sequence[Mapping[str, str]]) -> tuple[list[str], str]:
    """Return the run of each entry of a report, empty if nothing tells runs apart, and what does.

    `keys` (n) are what a run has once, `marks` (n) texts beside entries, by name. The first counts
    that is named as of runs and differs, or that has as many texts as the most frequent key has
    entries, all of a key different.

    >>> runs_of(["a", "b"], [{"part": "7"}, {"part": "8"}])
    (['7', '8'], 'part')
    >>> runs_of(["a", "b", "a", "b"], [{"at": text} for text in ("9:00", "9:00", "9:10", "9:10")])
    (['9:00', '9:00', '9:10', '9:10'], 'at')
    """
    most = max(Counter(keys).values(), default=1)
    for name in dict.fromkeys(name for beside in marks for name in beside):
        # What is below the first entries, as at the foot of a page, is true of them too.
        first = next(beside[name] for beside in marks if name in beside)
        texts = [beside.get(name, first) for beside in marks]
        count = len(set(texts))
        is_clear = count == most and len(set(zip(keys, texts, strict=True))) == len(keys)
        if count > 1 and (is_clear or OF_RUNS.fullmatch(name)):
            return texts, name
    return [""] * len(keys), ""
