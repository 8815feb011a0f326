"""Studies of many sips: who drinks from which neck, how it is computed, and what follows."""
