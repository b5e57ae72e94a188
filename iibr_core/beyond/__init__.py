"""What the paper does not have: views between views, free cameras, pictures at full size, lenses."""
