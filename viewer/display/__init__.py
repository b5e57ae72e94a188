"""Pictures of the open scene, of its inspection and of its folder, for the screen and for files."""
