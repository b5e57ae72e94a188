"""The running program: window, loop, input, files."""
