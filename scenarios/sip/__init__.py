"""A sip: lips, placement of the neck, the replay, what is measured of it."""
