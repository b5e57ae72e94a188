"""Disparity and depth maps in files. Readers and writers raise InputError where a file is damaged or not allowed."""
