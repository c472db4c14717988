"""Base class of all sections' settings, and common wording of messages."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Annotated, Any, Self, TypeVar

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    StringConstraints,
    Tag,
)


def _form(value: Any) -> str:
    # Messages omit tags in angle brackets from paths.
    return (
        "<mapping>"
        if isinstance(value, dict | BaseModel)
        else "<list>"
        if isinstance(value, tuple)
        else "<one>"
    )


One = TypeVar("One")
Listed = TypeVar("Listed")
Mapped = TypeVar("Mapped")

NonEmpty = Annotated[tuple[One, ...], Field(min_length=1)]
"""A list of one entry at least."""

# Entries of a list whose entries are compared with one another or combined.
MOST_SEVERAL = 1000

Several = Annotated[tuple[One, ...], Field(min_length=1, max_length=MOST_SEVERAL)]
"""A list of up to a thousand entries."""

Forms = Annotated[
    Annotated[One, Tag("<one>")]
    | Annotated[Listed, Tag("<list>")]
    | Annotated[Mapped, Tag("<mapping>")],
    Discriminator(_form),
]
"""A value that is one thing, a list or a mapping; an invalid value is validated as one thing, whose
message states the expected form.
"""

Text = Annotated[str, StringConstraints(min_length=1)]

# What is unknown may be an extension's.
LACKING = "if an extension provides it, install that"


def _text_of_whole_number(value: object) -> object:
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


# Numbers are usual as names of balls, and YAML reads them as numbers.
Name = Annotated[str, BeforeValidator(_text_of_whole_number), StringConstraints(min_length=1)]


class Settings(BaseModel):
    """A section of an experiment file: immutable, without unknown keys, without silent conversions.

    Lists of a file arrive as tuples, so fields holding several values are declared as tuples.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, strict=True, defer_build=True
    )

    @property
    def stated(self) -> dict[str, Any]:
        """Values that are not None, by the names of their fields."""
        return {key: value for key, value in self if value is not None}

    def completed(self, **content: Any) -> Self:
        """Return a copy with content of files that the settings name, by private attribute."""
        copy = self.model_copy()
        for name, value in content.items():
            setattr(copy, name, value)
        return copy


def listing(words: Iterable[str], limit: int = 8) -> str:
    """Write words as a comma-separated text, abbreviated beyond ``limit``.

    >>> listing(["a", "b"])
    'a, b'
    >>> listing("abcde", limit=3)
    'a, b, c and 2 more'
    """
    words = list(words)
    if len(words) > limit:
        return f"{', '.join(words[:limit])} and {len(words) - limit} more"
    return ", ".join(words)


def number_of(count: int, noun: str) -> str:
    """Return a count and its noun.

    >>> number_of(1, "line"), number_of(2, "line")
    ('1 line', '2 lines')
    """
    return f"{count} {noun}{'' if count == 1 else 's'}"


def hint(word: str, choices: Iterable[str]) -> str:
    """Return a suggestion of the nearest choice, or the list of choices.

    >>> hint("plat", ["plate", "bar"])
    'did you mean "plate"?'
    >>> hint("x", ["plate", "bar"])
    'known: plate, bar'
    """
    choices = list(dict.fromkeys(choices))
    candidate = nearest(word, choices)
    if candidate is not None:
        return f'did you mean "{candidate}"?'
    return f"known: {listing(choices)}" if choices else "there is none"


def nearest(word: str, choices: Iterable[str]) -> str | None:
    """Return the nearest known word, or None.

    >>> nearest("--exprot", ["--report", "--export"])
    '--export'
    """
    folded = {candidate.casefold(): candidate for candidate in reversed(list(choices))}
    # Comparing longer words would take long, and none is a typing error.
    typed = word.casefold()
    matches = difflib.get_close_matches(typed, folded) if len(word) <= 100 else []
    # Letters that are exchanged are the most frequent mistake.
    matches.sort(key=lambda match: sorted(match) != sorted(typed))
    return folded[matches[0]] if matches else None


def describe(value: Any) -> str:
    """Name a value of an experiment file in a sentence, as in "found …".

    >>> describe("a"), describe(750), describe((1, 2)), describe({}), describe(None)
    ('the text "a"', 'the number 750', 'a list', 'a mapping', 'nothing')
    """
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return f"the number {value}"
    if isinstance(value, str):
        return f'the text "{shorten(value)}"'
    return "a mapping" if isinstance(value, dict) else "a list"


def shorten(text: str, limit: int = 60) -> str:
    """Cut a text to fit in a one-line message.

    >>> shorten("a" * 70, limit=5)
    'aaaa…'
    """
    text = " ".join(text.split())
    return text if len(text) <= limit else text[: limit - 1] + "…"


def listed(words: list[str]) -> str:
    """Return words with commas and an "and" before the last."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
