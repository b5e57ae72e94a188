"""Origins of a photo's disparity: maps, files, models, guesses, views, and its edits."""
