"""Studies of many sips: who drinks from which neck, and how it is computed."""
