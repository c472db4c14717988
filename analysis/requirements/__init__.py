"""Reverse planning: which value of one unknown meets a goal."""
