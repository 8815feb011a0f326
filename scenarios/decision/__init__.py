"""What a study says: differences, what matters, a page; and a study from its file to that page."""
