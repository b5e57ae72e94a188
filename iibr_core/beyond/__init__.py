"""Extensions of the paper: views between given views, free cameras, pictures at full size, a lens."""
