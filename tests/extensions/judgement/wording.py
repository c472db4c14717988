"""The wording that the tests of judgement expect: a rewording is entered here alone."""

HAS_MORE_PARAMETERS = "has more parameters than the readings need; it changes"
IS_NOT_DETERMINED_BY_THIS_DESIGN = "is not determined by this design"
IS_NOT_NESTED = "is not nested with these; its BIC differs by {apart:+.1f}; it changes"
IS_TOO_SMALL = "is too small: {by} explains more (p-value <1e-06); it changes"
NOTHING_SHOWS_THAT_IT_IS_RICH = "its sufficiency is untested"
SOURCES_BY_THEIR_PART = "sources by their part of U6, the largest first"
