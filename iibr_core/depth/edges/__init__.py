"""Where a map's surfaces end: soft edges made sharp, rims moved to where the photo's colours end."""
