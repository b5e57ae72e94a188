"""Where a map's surfaces end: soft edges made sharp, edge bands moved to where the photo's colours end."""
