"""A scenario and its tables of named settings."""
