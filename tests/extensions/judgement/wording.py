"""The wording that the tests of judgement expect: a rewording is entered here alone."""

IS_NOT_DETERMINED_BY_THIS_DESIGN = "is not determined by this design"
NOTHING_SHOWS_THAT_IT_IS_RICH = "its sufficiency is untested"
SOURCES_BY_THEIR_PART = "sources by their part of U6, the largest first"
