"""The drawn recordings of the library: a person, a package, a motion."""
