"""The network that weighs rays which several surfaces may explain."""
