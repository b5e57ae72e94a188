"""Opening of photos and light fields, from the file to the last view, without window and threads."""
