"""Base of the hot loops: compiled kernels, bands of rows that can be cancelled, the machine, installed files."""
