"""What every package stands on: the base of all errors, progress, results that appear whole."""
