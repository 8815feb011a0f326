"""The rendered recordings of the library: a person, a package, a motion."""
