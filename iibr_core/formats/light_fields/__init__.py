"""Light fields on disk. All functions raise InputError, with the file's name, for files that they cannot read or write.

Readers return None for other layouts; writers write whole light fields or nothing.
"""
