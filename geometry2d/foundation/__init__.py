"""Foundation of all packages: base error, progress, atomic output, settings, text and tables."""
