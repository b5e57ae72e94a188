"""What is open: a photo or a light field from its file to its last view, without window and threads."""
