"""Work beside the window: requests in, results out."""
