"""Contact with friction: scalar laws, gap kinematics, rigid outlines, tissue on tissue."""
