"""Marking a film in the browser: which spot is which marker, scale, first contacts, corrections."""
