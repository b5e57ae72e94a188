"""Opening of photos and light fields, from the file to the last view, without window and threads.

All raise InputError for files that cannot be read and options that make no sense, Cancelled once the job is to stop.
"""
