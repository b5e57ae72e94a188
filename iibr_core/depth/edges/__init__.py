"""Sharp depth edges for any map: steps for soft edges, and edge bands on the side that the photo shows."""
