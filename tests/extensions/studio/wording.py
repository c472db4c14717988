"""The wording that the tests of studio expect: a rewording is entered here alone."""

ALL_CHANGES_ARE_SAVED = "all changes are saved"
CHANGES_ARE_NOT_SAVED_AND_ARE_IN_PLATE = (
    "changes are not saved, and are in .plate.yaml.unsaved: the same command restores them"
)
CHANGES_OF_ANOTHER = "has changes that are not saved; open it"
COULD_NOT_BE_KEPT = "could not be kept"
HAS_CHANGED_ON_DISK = "has changed on disk"
HAS_CHANGES = "has changes that are not saved"
HAS_NO_UNIT = "400.* has no unit"
IS_CODE_IN_PYTHON = "is code in Python"
IS_NOT_THE_NAME = "is not the name of a design in the folder"
IS_NO_CHARACTER = "is no character of a file"
IS_THERE_ALREADY = "is there already; choose another name"
LEAVE_SOME_OF_IT_OUT = "leave some of it out"
NOT_SAVED_IN_AN_EARLIER_SESSION = "not saved in an earlier session"
