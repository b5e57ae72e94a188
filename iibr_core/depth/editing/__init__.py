"""A user's edits of a disparity map: tone, clips, a brush and a bucket."""
