"""Photos in, pictures out.

Readers raise InputError, which names the file, where it is missing, of another kind, damaged, cut off or too large;
writers where it cannot be written. Functions that return None for other kinds of files raise it for damaged ones.
"""
