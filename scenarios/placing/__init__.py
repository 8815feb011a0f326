"""Where neck and lower face are in the head section: as given, or as the recording shows."""
