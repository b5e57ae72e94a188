"""Every command against what goes wrong: bad files, paths, options, environments, limits. One line, nothing harmed."""
