"""The search for the best dimensions of a neck."""
