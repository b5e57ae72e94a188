"""Where a photo's disparity comes from."""
