"""What a lens does: its focal surface, its aperture, its limits, its units."""
