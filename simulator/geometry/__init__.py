"""Where balls are: on their artefact, and where a position of the artefact puts them in the
machine.
"""
