"""The studio: a design moved and changed in the browser, which answers with its uncertainties."""
