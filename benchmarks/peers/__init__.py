"""What people use instead, each in a file: `prepare(photo, disparity)` gives a function from a view's offset to it."""
