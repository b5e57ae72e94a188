"""Files in and out: one module for each format. Bad files, places and options raise InputError."""
