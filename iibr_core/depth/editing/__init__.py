"""What a user does to a map: tone, clips, a brush."""
