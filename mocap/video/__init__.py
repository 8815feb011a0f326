"""Videos: their frames and the times at which these were taken."""
