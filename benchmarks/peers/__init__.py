"""Other ways to make views, each in a file: `prepare(photo, disparity)` gives a function from a view's offset to it."""
