"""Readings as laboratories write them: tables in any form, reports of programs, names matched."""
