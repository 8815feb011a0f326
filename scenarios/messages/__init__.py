"""What is said of a run: verdict against thresholds, lines for the person at the terminal."""
