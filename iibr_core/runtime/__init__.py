"""What the hot loops run on: compilation, row bands that hear a stop, files that come along."""
